// Adaptive bit probabilities, and the mixing of several predictions of the same bit.
//
// A bit is predicted in several contexts at once. Each context keeps a probability that moves
// towards the bits seen, quickly at first (1/n) and slowly later. The predictions are mixed in the
// logistic domain with weights learned on the way (Mahoney 2005, "Adaptive weighing of context
// models for lossless data compression"), so that few samples do not have to choose between a
// coarse context and a fine one. Integers only: every decoder on every machine gets the same
// probabilities. docs/dss-format.md states the arithmetic.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace rilievo {

// Probability of a 1 in one context: 22 bits of it, and how often the context was met.
class BitModel {
 public:
  int probability12() const { return static_cast<int>(state_ >> 20); }
  void Update(bool bit, int limit) {
    const uint32_t count = state_ & 1023;
    const int64_t probability = state_ >> 10;
    const int64_t target = bit ? (1 << 22) - 1 : 0;
    const int64_t moved = probability + (((target - probability) * kSteps[count]) >> 16);
    state_ = static_cast<uint32_t>(moved) << 10 |
             (count < static_cast<uint32_t>(limit) ? count + 1 : count);
  }

 private:
  // 65536 / (n + 1.5): the first bits move the probability far, the later ones by
  // 1 / (limit + 1.5).
  static constexpr std::array<uint16_t, 1024> kSteps = [] {
    std::array<uint16_t, 1024> steps{};
    for (int n = 0; n < 1024; ++n) steps[n] = static_cast<uint16_t>(2 * 65536 / (2 * n + 3));
    return steps;
  }();

  uint32_t state_ = 1u << 31;  // probability << 10 | count
};

// The logistic functions as integer tables. Stretch(p) = ln(p / (1 - p)) in 1/256, p in 1/4096;
// Squash is its inverse, with p in 1/65536.
class LogisticTables {
 public:
  static constexpr const LogisticTables& Get();
  int Stretch(int probability12) const { return stretch_[probability12]; }
  // `x` in 1/256, clamped to [-2047, 2047]; result in [22, 65514].
  int Squash(int64_t x) const {
    return squash_[static_cast<size_t>((x < -2047 ? -2047 : x > 2047 ? 2047 : x) + 2047)];
  }

  constexpr LogisticTables() {
    constexpr uint64_t kOne = uint64_t{1} << 32;
    constexpr uint64_t kExpStep = 4278222805u;  // e^(-1/256) in 1/2^32
    uint64_t exp_minus = kOne;                  // e^(-i/256) in 1/2^32
    for (int i = 0; i <= 2047; ++i) {
      const uint64_t probability = (kOne << 16) / (kOne + exp_minus);
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

 private:
  std::array<int16_t, 4096> stretch_{};
  std::array<uint16_t, 4095> squash_{};
};

inline constexpr LogisticTables kLogisticTables;
constexpr const LogisticTables& LogisticTables::Get() { return kLogisticTables; }

// Bits that coding a bit takes, by 1/4096 of its probability.
const std::array<float, 4096>& BitCosts();

// The same when a 1 has this probability in 1/65536.
inline double BitCost(const std::array<float, 4096>& costs, bool bit, int one_probability) {
  return costs[static_cast<size_t>((bit ? one_probability : 65535 - one_probability) >> 4)];
}

// Weights of `kInputs` predictions, in 1/65536.
template <int kInputs>
class BitMixer {
 public:
  BitMixer() { weights_.fill(kFirstWeight); }

  // Probability of a 1 in 1/65536, as Code would use it.
  int Probability(const std::array<const BitModel*, kInputs>& models) const {
    int stretched[kInputs];
    return Mix(models, stretched);
  }

  // Codes one bit predicted by `models` and teaches them and the weights.
  template <typename Coder>
  bool Code(Coder& coder, bool bit, const std::array<BitModel*, kInputs>& models, int limit) {
    int stretched[kInputs];
    const int probability = Mix(models, stretched);
    bit = coder.Code(bit, static_cast<uint32_t>(probability));
    const int64_t error = (bit ? 65536 : 0) - probability;
    const int rate = kRates[static_cast<size_t>(count_)];
    if (count_ + 1 < kMaxCount) ++count_;
    for (int i = 0; i < kInputs; ++i) {
      weights_[i] += static_cast<int32_t>((stretched[i] * error * rate + (1 << 17)) >> 18);
      models[i]->Update(bit, limit);
    }
    return bit;
  }

 private:
  static constexpr int32_t kFirstWeight = 65536 * 5 / (4 * kInputs);
  template <typename Models>
  int Mix(const Models& models, int* stretched) const {
    const LogisticTables& tables = LogisticTables::Get();
    int64_t sum = 0;
    for (int i = 0; i < kInputs; ++i) {
      stretched[i] = tables.Stretch(models[i]->probability12());
      sum += static_cast<int64_t>(weights_[i]) * stretched[i];
    }
    return tables.Squash(sum >> 16);
  }

  // By the bits seen before.
  static constexpr int kLastRate = 2, kExtraRate = 64, kMaxCount = 255;
  static constexpr std::array<int, kMaxCount> kRates = [] {
    std::array<int, kMaxCount> rates{};
    for (int n = 0; n < kMaxCount; ++n) rates[n] = kLastRate + kExtraRate / (n + 1);
    return rates;
  }();
  std::array<int32_t, kInputs> weights_;
  int count_ = 0;
};

}  // namespace rilievo
