// Covariance normals, local spacing and noise from the neighbour lists.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/scan/neighbor_graph.h"
#include "core/scan/oriented_cloud.h"

namespace rilievo {

// Normals are unoriented (see OrientNormals). `points`: unit frame, the graph's own points.
absl::StatusOr<OrientedCloud> EstimateNormals(Eigen::Matrix3Xd points, const NeighborGraph& graph,
                                              const RunContext& context);

}  // namespace rilievo
