#include "core/scan/outliers.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/scan/parity_sets.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 4096;
// No island with so many points is dropped, however large the scan.
constexpr int kLargestIsland = 200;

}  // namespace

absl::Status OutlierOptions::Validate() const {
  if (distance_factor != 0 && !(distance_factor >= 1.5 && std::isfinite(distance_factor))) {
    return absl::InvalidArgumentError(
        absl::StrCat("distance_factor: ", distance_factor, " is neither 0 (off) nor at least 1.5"));
  }
  if (!(min_component_share >= 0 && min_component_share <= 0.1)) {
    return absl::InvalidArgumentError(
        absl::StrCat("min_component_share: ", min_component_share, " is outside [0, 0.1]"));
  }
  return absl::OkStatus();
}

absl::StatusOr<OutlierResult> FindOutliers(const Eigen::Matrix3Xd& points,
                                           const NeighborGraph& graph,
                                           const OutlierOptions& options,
                                           const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  OutlierResult result;
  result.keep.assign(static_cast<size_t>(points.cols()), 1);
  std::vector<float> reach(result.keep.size());
  for (int i = 0; i < graph.size(); ++i) {
    double sum = 0;
    for (const float distance : graph.neighbor_distances(i)) sum += distance;
    reach[i] = static_cast<float>(sum / graph.k);
  }
  if (options.distance_factor > 0) {
    RILIEVO_RETURN_IF_ERROR(
        ParallelFor(graph.size(), kBlock, context, [&](int64_t begin, int64_t end) {
          std::vector<float> near(graph.k);
          for (int64_t i = begin; i < end; ++i) {
            const auto neighbors = graph.neighbors(static_cast<int>(i));
            for (int j = 0; j < graph.k; ++j) near[j] = reach[neighbors[j]];
            std::nth_element(near.begin(), near.begin() + graph.k / 2, near.end());
            if (reach[i] > options.distance_factor * near[graph.k / 2]) result.keep[i] = 0;
          }
        }));
  }
  result.outliers = std::count(result.keep.begin(), result.keep.end(), 0);
  ParitySets sets(graph.size());
  for (int i = 0; i < graph.size(); ++i) {
    if (!result.keep[i]) continue;
    for (const int j : graph.neighbors(i)) {
      if (result.keep[j]) sets.Join(i, j, 0);
    }
  }
  const double smallest =
      std::min<double>(kLargestIsland, options.min_component_share * graph.size());
  for (int i = 0; i < graph.size(); ++i) {
    if (!result.keep[i] || sets.size(sets.Find(i)) >= smallest) continue;
    result.keep[i] = 0;
    ++result.island_points;
  }
  return result;
}

}  // namespace rilievo
