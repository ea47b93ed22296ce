// Sheets that lie so close on top of each other that neighbours come from both.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/scan/neighbor_graph.h"

namespace rilievo {

// A point and one of the sheet that faces its own across a wall or a gap.
struct FacingPair {
  int point, across;
};

// Where the points around a point stand in two layers with next to nothing between them, gives it
// the nearest neighbours of its own layer instead of the nearest of all. Heights over a quadric
// tell the layers apart, each with its share of the points (Otsu 1979), from about four times the
// noise on and wherever the lists of the graph are too short to. One of each few points is looked
// at, and all around those that stand in a layer. Returns a pair for each point that does,
// ascending.
absl::StatusOr<std::vector<FacingPair>> SeparateSheets(const Eigen::Matrix3Xd& points,
                                                       const PointIndex& index,
                                                       const RunContext& context,
                                                       NeighborGraph* graph);

}  // namespace rilievo
