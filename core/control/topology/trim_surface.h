// Cutting away what no point supports, and mending what the cutting leaves.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/control_options.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// `surface`: an orientable 2-manifold, all of its vertices used (see SplitFans).
// Vertices without support (see FindSupport) are cut away, but for holes within, and so are pieces
// whose supported area is less than 25 squared spacings, but for the largest of four or more.
// Result: an orientable 2-manifold, possibly with boundary, possibly of several components.
// With BoundaryRule::kClose only small pieces are dropped and nothing is cut.
absl::StatusOr<ControlMesh> TrimSurface(const ControlMesh& surface, const OrientedCloud& cloud,
                                        const PointIndex& index, BoundaryRule boundary,
                                        const RunContext& context);

}  // namespace rilievo
