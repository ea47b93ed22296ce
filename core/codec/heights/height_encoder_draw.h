// How far values are drawn towards zero when they are decoded.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace rilievo {

// How far towards zero the mean of what was coded as 1 ([0]; [1]: as more than 1) lies, in 1/256 of
// the step, for Dequantizer::draw. `targets`: coefficients before quantisation, in the unit of
// `step`; `coded`: after it. Of those in [begin, end).
std::array<int, 2> MeanDraw(const std::vector<double>& targets, const std::vector<int32_t>& coded,
                            int begin, int end, int32_t step);

}  // namespace rilievo
