// The control mesh around a cloud that is star-shaped (Jeong and Kim 2002, section 4.1).
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// The bounding octahedron, refined, its vertices moved to the points
// met by rays from the centre, which is where most of the surface is seen from inside. Closed
// whatever the points; directions that meet none are filled smoothly. 8 * 4^levels faces, the power
// nearest to the target: 4 098 vertices for 8 192. FAILED_PRECONDITION when the rays meet several
// sheets in more than 20 % of the directions, points in less than half of them, or more than 20 %
// of the surface from its other side.
absl::StatusOr<ControlMesh> SphericalControlMesh(const OrientedCloud& cloud, int target_faces,
                                                 const RunContext& context);

// How many faces it makes when so many are asked for.
int SphericalControlFaces(int target_faces);

}  // namespace rilievo
