// The unit of the decoder's integers: finer than the quantiser's steps, wide enough for all
// heights.
#pragma once

#include <vector>

namespace rilievo {

// Fraction of the diagonal, as `steps` of the levels, `heights` and `targets` (coefficients before
// quantisation) are. 32 units or more to the smallest step, unless heights or targets would then
// lie beyond the decoder's range; never less than `least`.
double UnitOfHeights(const std::vector<double>& steps, const std::vector<double>& heights,
                     const std::vector<double>& targets, double least);

// The next to try where decoded heights did not fit: far from what was told, filled ones may come
// out much larger than those that were given.
double WiderUnit(double unit);

}  // namespace rilievo
