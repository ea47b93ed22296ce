#include "tests/accuracy/local_spacing.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel_for.h"

namespace rilievo {

std::vector<float> LocalSpacing(const Eigen::Matrix3Xd& points, const PointIndex& index) {
  constexpr int kNeighbors = 7;  // with the point itself
  constexpr double kSixthOfSpacing = 1.4, kMostPercentile = 0.95;
  std::vector<float> spacing(static_cast<size_t>(points.cols()));
  ParallelFor(points.cols(), 4096, RunContext{}, [&](int64_t begin, int64_t end) {
    int found[kNeighbors];
    double squared[kNeighbors];
    for (int64_t i = begin; i < end; ++i) {
      const int count = index.Nearest(points.col(i), kNeighbors, found, squared);
      spacing[i] = static_cast<float>(std::sqrt(squared[count - 1]) / kSixthOfSpacing);
    }
  }).IgnoreError();
  std::vector<float> sorted = spacing;
  const auto most = sorted.begin() + static_cast<std::ptrdiff_t>(
                                         kMostPercentile * static_cast<double>(sorted.size()));
  std::nth_element(sorted.begin(), most, sorted.end());
  for (float& value : spacing) value = std::min(value, *most);
  return spacing;
}

}  // namespace rilievo
