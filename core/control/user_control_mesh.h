// A control mesh given by the user.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Checks a mesh given by the user: INVALID_ARGUMENT unless it has at most 200 000 faces, is finite,
// an orientable 2-manifold, and near the cloud: half of either within a quarter of the diagonal of
// the other; and unless its tags are ones of it (crease_topology.h).
absl::StatusOr<ControlMesh> CheckUserControlMesh(const ControlMesh& mesh,
                                                 const OrientedCloud& cloud,
                                                 const RunContext& context);

}  // namespace rilievo
