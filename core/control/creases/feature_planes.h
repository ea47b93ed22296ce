// The planes of a scan's points beside the faces of a mesh that rounds their edges off.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/simplify/simplify_mesh.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// For each face of `mesh`: where the mesh bends, the plane of the points of one side of the bend,
// the side that the face is nearer to (mean shift over the points' normals, Comaniciu and Meer
// 2002); elsewhere the face's own plane. Quadrics of such planes have their least value on the
// sharp edge and not on the bevel that an iso-surface makes of it. `index` holds the points of
// `cloud`. CANCELLED after a stop request.
absl::StatusOr<FacePlanes> FeaturePlanes(const OrientedCloud& cloud, const PointIndex& index,
                                         const ControlMesh& mesh, const RunContext& context);

}  // namespace rilievo
