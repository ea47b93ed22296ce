// A control mesh of fewer faces from one that stands.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// The same topology with about `target_faces` faces, at least 4, shaped as ArbitraryControlMesh()
// shapes its own. Creases and corners are kept: a finer mesh has edges along them where a coarser
// one would have none. More faces remain where the creases allow no more collapses. Far cheaper
// than building the mesh anew: 10 ms from 3 300 faces. INVALID_ARGUMENT for a mesh that is not a
// manifold.
absl::StatusOr<ControlMesh> CoarserControlMesh(const ControlMesh& mesh, int target_faces,
                                               const RunContext& context);

}  // namespace rilievo
