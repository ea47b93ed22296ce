// Normals of noisy points beside edges, each on its own side.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// A point around which the points lie farther off a plane than their noise explains.
struct NearEdgePoint {
  int point;
  float noise;  // measurement noise there, unit frame, > 0
};

// Gives those of the points that stand by an edge the normals of their sides, with the sign that
// most of the side's normals had: a plane through all around such a point blends both. The nearest
// 48 of the points within three steps along the graph, and the half of them, are described by a
// quadric and by two planes that meet (a hinge, Breiman 1993), points off both planes weighing
// little in these. The planes are taken where they explain the points as well as their noise
// allows, and better than the quadric by far: both have six unknowns, so their truncated squares in
// noises compare. Asked for after orientation, which wants normals that turn little from point to
// point. `near_edge`: each point once.
absl::Status SharpenNormals(const NeighborGraph& graph, const std::vector<NearEdgePoint>& near_edge,
                            const RunContext& context, OrientedCloud* cloud);

}  // namespace rilievo
