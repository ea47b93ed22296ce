// What each edge of the neighbour graph says of the signs of its two normals.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

// One value in [-1, 1] for each entry of graph.indices: > 0 when the normals of the point and of
// that neighbour, as they are, point to the same side of the surface, < 0 when to opposite sides;
// near 0 when the edge cannot tell.
// Pairs that face each other across a thin wall are told by the points around them.
absl::StatusOr<std::vector<float>> NormalRelations(const NeighborGraph& graph,
                                                   const OrientedCloud& cloud,
                                                   const RunContext& context);

// The same for any two points, from these two alone.
double NormalRelation(const OrientedCloud& cloud, int a, int b);

}  // namespace rilievo
