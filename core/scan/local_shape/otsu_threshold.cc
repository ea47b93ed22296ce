#include "core/scan/local_shape/otsu_threshold.h"

#include <algorithm>

namespace rilievo {

OtsuSplit OtsuThreshold(std::span<double> heights, int fewest) {
  std::sort(heights.begin(), heights.end());
  const auto count = static_cast<int>(heights.size());
  double sum = 0, squares = 0;
  for (const double height : heights) {
    sum += height;
    squares += height * height;
  }
  const double spread = squares - sum * sum / count;
  OtsuSplit best;
  double between = 0, below = 0;
  for (int i = 1; i < count; ++i) {
    below += heights[i - 1];
    if (i < fewest || i + fewest > count) continue;
    const double low = below / i, high = (sum - below) / (count - i), step = high - low;
    const double gained = static_cast<double>(i) * (count - i) / count * step * step;
    if (gained <= between) continue;
    between = gained;
    best.threshold = (heights[i - 1] + heights[i]) / 2;
  }
  if (spread > 0) best.within = 1 - between / spread;
  return best;
}

}  // namespace rilievo
