// A Loop surface without heights as a .dss file.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/container/dss.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// `mesh`: any unit. Its control points come back to within 4e-9 of the diagonal of their bounding
// box; the heights of its `max_level` levels, [0, kMaxLoopLevel], are zero and count as measured.
// INVALID_ARGUMENT where the mesh is not a manifold, as BoundingFrame(), and for another level.
absl::StatusOr<EncodedSurface> EncodeSmoothSurface(const ControlMesh& mesh, int max_level,
                                                   const DssMetadata& metadata,
                                                   const RunContext& context);

}  // namespace rilievo
