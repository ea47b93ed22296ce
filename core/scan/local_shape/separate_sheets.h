// Sheets that lie so close on top of each other that neighbours come from both.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/spatial_frame.h"
#include "core/points/neighbor_graph.h"

namespace rilievo {

// Lists that a graph had before others took their place: k entries a point.
struct ReplacedLists {
  std::vector<int> points;
  std::vector<int> lists;

  // Of points[i], ascending by distance.
  std::span<const int> list(int64_t i, int k) const {
    return {lists.data() + i * k, static_cast<size_t>(k)};
  }
};

// Where the 64 points nearest to a point stand in two sheets with next to nothing between them, the
// graph gets the nearest neighbours of its own sheet instead of the nearest of all, and a facing
// pair. Heights over a quadric tell the sheets apart (Otsu 1979) from about four times the noise
// on. One of each few points is looked at, and all around those that stand in a sheet; one in a
// hundred does by chance under noise. Points whose sheet holds no graph.k others among the 64, and
// scans of fewer than 64 points, stay as they are. `curve`: see CodesAlong.
absl::StatusOr<ReplacedLists> SeparateSheets(const Eigen::Matrix3Xd& points,
                                             const PointIndex& index, const SpatialFrame& curve,
                                             const RunContext& context, NeighborGraph* graph);

// Makes the graph what it was before SeparateSheets.
void JoinSheets(const ReplacedLists& replaced, NeighborGraph* graph);

}  // namespace rilievo
