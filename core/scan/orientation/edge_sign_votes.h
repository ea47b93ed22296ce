// Votes of the edges of the neighbour graph on the signs of their two normals.
#pragma once

#include <span>
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

// The same for any two points, from these two alone: near 0 where StepBetween, for the wall of a
// shell and the floors of a stair look the same then.
double SignVote(const OrientedCloud& cloud, int a, int b);

// Whether the planes of two points are parallel and apart by more than noise and spacing explain.
bool StepBetween(const OrientedCloud& cloud, int a, int b);

// The same as SignVote for two points with a step between them. `around`: points of b's
// sheet, those nearest to a. Where they lie all around a, the sheets face each other; where on one
// side only, or fewer than three, nothing is said (0).
double WallVote(const OrientedCloud& cloud, int a, int b, std::span<const int> around);

}  // namespace rilievo
