// The roads themselves; BuildControlMesh chooses among them.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/build_control_mesh.h"

namespace rilievo {

// Seed 004, 4.1: a regular triangulation of the occupied area over the points' plane, lifted to the
// points. Holes wider than six median spacings and larger than two faces stay open under
// BoundaryRule::kKeep; kClose fills them all, and leaves the outer border as it is.
// FAILED_PRECONDITION when the points lie on several sheets over a quarter of the plane or more.
absl::StatusOr<ControlMesh> PlanarControlMesh(const OrientedCloud& cloud, const PointIndex& index,
                                              BoundaryRule boundary, int target_faces,
                                              const RunContext& context);

// Seed 004, 4.1: the bounding octahedron, refined, its vertices moved to the points
// met by rays from the centre, which is where most of the surface is seen from inside. Closed
// whatever the points; directions that meet none are filled smoothly. 8 * 4^levels faces, the power
// nearest to the target: 4 098 vertices for 8 192. FAILED_PRECONDITION when the rays meet several
// sheets in more than 15 % of the directions, points in less than half of them, or more than 15 %
// of the surface from its other side.
absl::StatusOr<ControlMesh> SphericalControlMesh(const OrientedCloud& cloud,
                                                 const PointIndex& index, int target_faces,
                                                 const RunContext& context);

// The main road: an implicit function of the oriented points, its iso-surface, trimmed where no
// point supports it, simplified; its creases tagged unless `creases` says no. The cloud's normals
// take the sides that the function found.
absl::StatusOr<ControlMesh> ArbitraryControlMesh(const NeighborGraph& graph,
                                                 const PointIndex& index, BoundaryRule boundary,
                                                 int target_faces, const RunContext& context,
                                                 OrientedCloud* cloud,
                                                 CreaseRule creases = CreaseRule::kAuto);

// Checks a mesh given by the user: INVALID_ARGUMENT unless it has at most 200 000 faces, is finite,
// an orientable 2-manifold, and near the cloud: half of either within a quarter of the diagonal of
// the other.
absl::StatusOr<ControlMesh> CheckUserControlMesh(const ControlMesh& mesh,
                                                 const OrientedCloud& cloud,
                                                 const RunContext& context);

}  // namespace rilievo
