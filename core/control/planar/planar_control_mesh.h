// The control mesh over the plane of a cloud that is a height field (Jeong and Kim 2002,
// section 4.1).
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/control_options.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// A regular triangulation of the occupied area over the points' plane, lifted to the
// points. Holes wider than six median spacings and larger than two faces stay open under
// BoundaryRule::kKeep; kClose fills them all, and leaves the outer border as it is.
// FAILED_PRECONDITION when the points lie on several sheets over a quarter of the plane or more.
absl::StatusOr<ControlMesh> PlanarControlMesh(const OrientedCloud& cloud, BoundaryRule boundary,
                                              int target_faces, const RunContext& context);

}  // namespace rilievo
