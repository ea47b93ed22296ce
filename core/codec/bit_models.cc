#include "core/codec/bit_models.h"

#include <cmath>

namespace rilievo {
namespace {

// 65536 / (n + 1.5): the first bits move the probability far, the later ones by 1 / (limit + 1.5).
constexpr std::array<uint16_t, 1024> MakeSteps() {
  std::array<uint16_t, 1024> steps{};
  for (int n = 0; n < 1024; ++n) steps[n] = static_cast<uint16_t>(2 * 65536 / (2 * n + 3));
  return steps;
}

constexpr std::array<uint16_t, 1024> kSteps = MakeSteps();

constexpr uint64_t kExpStep = 4278222805u;  // e^(-1/256) in 1/2^32

// Bits of an event of probability (i + 1/2) / 4096.
std::array<float, 4096> MakeCosts() {
  std::array<float, 4096> costs{};
  for (int i = 0; i < 4096; ++i) costs[i] = static_cast<float>(-std::log2((i + 0.5) / 4096));
  return costs;
}

}  // namespace

double BitCost(bool bit, int one_probability) {
  static const std::array<float, 4096> costs = MakeCosts();
  return costs[(bit ? one_probability : 65535 - one_probability) >> 4];
}

void BitModel::Update(bool bit, int limit) {
  const uint32_t count = state_ & 1023;
  const int64_t probability = state_ >> 10;
  const int64_t target = bit ? (1 << 22) - 1 : 0;
  const int64_t moved = probability + (((target - probability) * kSteps[count]) >> 16);
  state_ = static_cast<uint32_t>(moved) << 10 |
           (count < static_cast<uint32_t>(limit) ? count + 1 : count);
}

const LogisticTables& LogisticTables::Get() {
  static const LogisticTables tables;
  return tables;
}

LogisticTables::LogisticTables() {
  uint64_t exp_minus = uint64_t{1} << 32;  // e^(-i/256) in 1/2^32
  for (int i = 0; i <= 2047; ++i) {
    const uint64_t one = uint64_t{1} << 32;
    const uint64_t probability = (one << 16) / (one + exp_minus);
    squash_[2047 + i] = static_cast<uint16_t>(probability);
    squash_[2047 - i] = static_cast<uint16_t>(65536 - probability);
    exp_minus = (exp_minus * kExpStep) >> 32;
  }
  // The smallest x whose probability is above the middle of cell p.
  int x = -2047;
  for (int p = 0; p < 4096; ++p) {
    while (x < 2047 && squash_[x + 2047] < 16 * p + 8) ++x;
    stretch_[p] = static_cast<int16_t>(x);
  }
}

}  // namespace rilievo
