// Consistent orientation of normals by what the scanner knows, by votes between neighbours, and by
// the winding number.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_sights.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/orientation/sight_votes.h"

namespace rilievo {

struct OrientationResult {
  int components = 0;  // groups of points, each turned as a whole
  // Share of graph edges whose normals disagree after orientation, in [0, 1]: near 0 on a
  // surface, higher where sheets touch, on a Moebius band or in a volume of points.
  double disagreement = 0;
  SightFigures stations, normals;  // what was given, and whether it was used
};

// Flips cloud->normals in place and marks the points whose orientation is ambiguous. Where sights
// are used (see SightOptions), normals face the stations, or the side of the given ones, as far as
// the neighbours do not outvote a single point; elsewhere closed parts face outward. `sights`: of
// the cloud's points, in their frame; they go once they have been asked.
absl::StatusOr<OrientationResult> OrientNormals(const NeighborGraph& graph, PointSights sights,
                                                const SightOptions& options, OrientedCloud* cloud,
                                                const RunContext& context);

}  // namespace rilievo
