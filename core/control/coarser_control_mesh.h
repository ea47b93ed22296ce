// A control mesh of fewer faces from one that stands.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/build_control_mesh.h"
#include "core/geometry/triangle_mesh.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

// The same topology with about `target_faces` faces, at least 4, shaped as the road arbitrary
// shapes its own; crease tags are found anew in the cloud unless `creases` says no or `mesh` has
// none. `mesh`: as BuildControlMesh() made it from this cloud. Far cheaper than the road itself: 10
// ms from 3 300 faces, and the creases. INVALID_ARGUMENT for a mesh that is no manifold.
absl::StatusOr<ControlMesh> CoarserControlMesh(const OrientedCloud& cloud, const PointIndex& index,
                                               const ControlMesh& mesh, int target_faces,
                                               CreaseRule creases, const RunContext& context);

}  // namespace rilievo
