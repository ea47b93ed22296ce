// How many points a fit wants.
#pragma once

#include <algorithm>

namespace rilievo {

// So many that a plane through them is as sure as one through `fewest` points of a clean scan: more
// where they are noisier, at most `most`. `noise` and `spacing` in the same unit.
inline int NeighborhoodSize(int fewest, int most, double noise, double spacing) {
  const double ratio = spacing > 0 ? noise / spacing : 0;
  return static_cast<int>(
      std::clamp(fewest * (1 + 12 * ratio * ratio), double(fewest), double(most)));
}

}  // namespace rilievo
