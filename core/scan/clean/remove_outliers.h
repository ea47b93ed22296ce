// Points that belong to no surface.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/neighbor_graph.h"

namespace rilievo {

struct OutlierOptions {
  // A point is an outlier when its mean neighbour distance exceeds the median of its neighbours'
  // by this factor (a local form of the statistical filter, so that a 30:1 change of density is no
  // outlier), or when it stands off its neighbours' plane by as much. [1.5, inf); 0: off.
  double distance_factor = 3.0;
  // Islands of the neighbour graph with fewer points than this share of all are dropped. [0, 0.1].
  double min_component_share = 0.002;
  absl::Status Validate() const;
};

struct OutlierResult {
  std::vector<uint8_t> keep;  // per point
  int64_t outliers = 0;
  int64_t island_points = 0;  // of dropped islands
};

absl::StatusOr<OutlierResult> FindOutliers(const Eigen::Matrix3Xd& points,
                                           const NeighborGraph& graph,
                                           const OutlierOptions& options,
                                           const RunContext& context);

}  // namespace rilievo
