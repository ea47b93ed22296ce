// The roads themselves; BuildControlMesh chooses among them.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/build_control_mesh.h"

namespace rilievo {

// Seed 004, 4.1: a regular triangulation of the occupied area over the points' plane.
absl::StatusOr<ControlMesh> PlanarControlMesh(const OrientedCloud& cloud, const PointIndex& index,
                                              BoundaryRule boundary, int target_faces,
                                              const RunContext& context);

// Seed 004, 4.1: the bounding octahedron, refined `levels` times, its vertices moved to the points
// met by rays from the centre.
absl::StatusOr<ControlMesh> SphericalControlMesh(const OrientedCloud& cloud,
                                                 const PointIndex& index, int target_faces,
                                                 const RunContext& context);

// The main road: an implicit function of the oriented points, its iso-surface, trimmed where no
// point supports it, simplified.
absl::StatusOr<ControlMesh> ArbitraryControlMesh(const OrientedCloud& cloud,
                                                 const NeighborGraph& graph,
                                                 const PointIndex& index, BoundaryRule boundary,
                                                 int target_faces, const RunContext& context);

// Checks a mesh given by the user: manifold, orientable, finite, near the cloud.
absl::StatusOr<ControlMesh> CheckUserControlMesh(const ControlMesh& mesh,
                                                 const OrientedCloud& cloud,
                                                 const RunContext& context);

}  // namespace rilievo
