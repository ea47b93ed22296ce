// Votes of the edges of the neighbour graph on the signs of their two normals.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// One value in [-1, 1] for each entry of graph.indices: > 0 when the normals of the point and of
// that neighbour, as they are, point to the same side of the surface, < 0 when to opposite sides;
// near 0 when the edge cannot tell.
// Pairs that face each other across a thin wall are told by the points around them.
absl::StatusOr<std::vector<float>> EdgeSignVotes(const NeighborGraph& graph,
                                                 const OrientedCloud& cloud,
                                                 const RunContext& context);

// The same for any two points, from these two alone: near 0 where their planes are parallel and
// apart by more than noise and spacing explain, for the wall of a shell and the floors of a stair
// look the same then.
double SignVote(const OrientedCloud& cloud, int a, int b);

}  // namespace rilievo
