#include "core/codec/bytes/bit_models.h"

#include <cmath>

namespace rilievo {
namespace {

// Bits of an event of probability (i + 1/2) / 4096.
std::array<float, 4096> MakeCosts() {
  std::array<float, 4096> costs{};
  for (int i = 0; i < 4096; ++i) costs[i] = static_cast<float>(-std::log2((i + 0.5) / 4096));
  return costs;
}

}  // namespace

const std::array<float, 4096>& BitCosts() {
  static const std::array<float, 4096> costs = MakeCosts();
  return costs;
}

}  // namespace rilievo
