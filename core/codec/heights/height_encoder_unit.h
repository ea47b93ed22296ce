// The unit of the decoder's integers: finer than the quantiser's steps, wide enough for all
// heights.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace rilievo {

// The largest magnitude; 0 if there are none.
template <typename Value>
double Farthest(const std::vector<Value>& values) {
  double farthest = 0;
  for (const Value value : values) farthest = std::max(farthest, std::abs(double{value}));
  return farthest;
}

// Fraction of the diagonal, as `steps` of the levels and the largest magnitudes of heights and of
// targets (coefficients before quantisation) are. 32 units or more to the smallest step, unless
// heights or targets would then lie beyond the decoder's range; never less than `least`.
double UnitOfHeights(const std::vector<double>& steps, double highest, double largest_target,
                     double least);

// Of each level's quantiser, where the finest has `step` (HeightCoding::Encode). `level_gains`:
// CoefficientGains::of_level.
std::vector<double> StepsOfLevels(double step, const std::vector<double>& level_gains);

// Within what a file can say.
int32_t StepInUnits(double step, double unit);

// The next to try where decoded heights did not fit: far from what was told, filled ones may come
// out much larger than those that were given.
double WiderUnit(double unit);

}  // namespace rilievo
