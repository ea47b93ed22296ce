// Sheets that lie so close on top of each other that neighbours come from both.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/scan/neighbor_graph.h"

namespace rilievo {

// Where the 64 points nearest to a point stand in two layers with next to nothing between them, the
// graph that is returned has the nearest neighbours of its own layer instead of the nearest of all,
// and a facing pair. Nothing is returned where no point does. Heights over a quadric tell the
// layers apart (Otsu 1979) from about four times the noise on. One of each few points is looked at,
// and all around those that stand in a layer; one in a hundred does by chance under noise. Points
// whose layer holds no graph.k others among the 64, and scans of fewer than 64 points, stay as they
// are.
absl::StatusOr<std::optional<NeighborGraph>> SeparateSheets(const Eigen::Matrix3Xd& points,
                                                            const PointIndex& index,
                                                            const NeighborGraph& graph,
                                                            const RunContext& context);

}  // namespace rilievo
