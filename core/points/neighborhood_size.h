// How many points a fit wants.
#pragma once

#include <algorithm>
#include <cmath>

namespace rilievo {

// So many that a plane through them is as sure as one through `fewest` points of a clean scan: more
// where they are noisier, at most `most`. `noise` and `spacing` in the same unit.
inline int NeighborhoodSize(int fewest, int most, double noise, double spacing) {
  const double ratio = spacing > 0 ? noise / spacing : 0;
  return static_cast<int>(
      std::clamp(fewest * (1 + 12 * ratio * ratio), double(fewest), double(most)));
}

// Within which so many points mostly lie: on four scans, clean and noisy, fewer did at most 4 times
// of 100, and in the mean a fifth more. On a flat disc a quarter would be enough.
inline double LikelyRadius(int count, double spacing) {
  constexpr double kArea = 0.36;  // squared radius over squared spacings, a point
  return spacing * std::sqrt(kArea * count);
}

}  // namespace rilievo
