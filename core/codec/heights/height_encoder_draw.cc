#include "core/codec/heights/height_encoder_draw.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace rilievo {

std::array<int, 2> MeanDraw(const std::vector<double>& targets, const std::vector<int32_t>& coded,
                            int begin, int end, int32_t step) {
  constexpr int kFewest = 8;
  std::array<double, 2> sum{};
  std::array<int, 2> count{}, draw{};
  for (int v = begin; v < end; ++v) {
    if (coded[v] == 0) continue;
    const int magnitude = std::abs(coded[v]), kind = magnitude > 1 ? 1 : 0;
    sum[kind] += magnitude - std::abs(targets[v]) / step;
    ++count[kind];
  }
  for (int kind = 0; kind < 2; ++kind) {
    if (count[kind] < kFewest) continue;
    draw[kind] = std::clamp(static_cast<int>(std::lround(256 * sum[kind] / count[kind])), 0, 127);
  }
  return draw;
}

}  // namespace rilievo
