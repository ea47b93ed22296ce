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
absl::StatusOr<std::vector<float>> EdgeSignVotes(const NeighborGraph& graph,
                                                 const OrientedCloud& cloud,
                                                 const RunContext& context);

}  // namespace rilievo
