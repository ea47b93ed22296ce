// Signed integers, small ones likelier, as bits predicted in several contexts at once.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "core/codec/bytes/bit_models.h"

namespace rilievo {

// A residual is coded as: is it zero; its sign; the number of bits of its magnitude, in unary; the
// two bits below the leading one; then what is left, lowest bits last, at even odds.
template <int kInputs>
class ResidualModel {
 public:
  using Contexts = std::array<int, kInputs>;
  static constexpr int kMaxBits = 30;  // |residual| < 2^30

  // `sizes`: number of contexts of each input. `limit`: see BitModel.
  ResidualModel(const Contexts& sizes, int limit) : mixers_(kNodes), limit_(limit) {
    for (int i = 0; i < kInputs; ++i) models_[i].resize(static_cast<size_t>(sizes[i]) * kNodes);
  }

  // Encoders return `value`; decoders ignore it and return what they read.
  template <typename Coder>
  int32_t Code(Coder& coder, int32_t value, const Contexts& contexts) {
    return CodeWithSign(coder, value, contexts,
                        [&](bool negative) { return CodeNode(coder, negative, kSign, contexts); });
  }

  // The same with the sign coded by `sign`: told the sign (by an encoder) it returns the sign.
  template <typename Coder, typename Sign>
  int32_t CodeWithSign(Coder& coder, int32_t value, const Contexts& contexts, const Sign& sign) {
    if (!CodeNode(coder, value != 0, kNonZero, contexts)) return 0;
    const bool negative = sign(value < 0);
    const uint32_t given = value < 0 ? -static_cast<uint32_t>(value) : static_cast<uint32_t>(value);
    const int given_bits = std::bit_width(given);
    int bits = 1;
    while (bits < kMaxBits && CodeNode(coder, given_bits > bits, kLength + bits, contexts)) ++bits;
    uint32_t magnitude = 1;
    for (int at = bits - 2; at >= 0; --at) {
      const bool given_bit = ((given >> at) & 1) != 0;
      const int done = bits - 2 - at;
      const bool bit =
          done == 0   ? CodeNode(coder, given_bit, kFirst + bits, contexts)
          : done == 1 ? CodeNode(coder, given_bit,
                                 kSecond + 2 * bits + static_cast<int>(magnitude & 1), contexts)
                      : coder.Code(given_bit, 32768);
      magnitude = 2 * magnitude + (bit ? 1 : 0);
    }
    return negative ? -static_cast<int32_t>(magnitude) : static_cast<int32_t>(magnitude);
  }

  // What magnitudes would take in the same place, in bits. Refers to the model and the contexts;
  // the model must not learn meanwhile.
  class Prices {
   public:
    Prices(const ResidualModel& model, const Contexts& contexts)
        : model_(model), contexts_(contexts) {}

    double Bits(uint32_t magnitude) {
      double sum = NodeBits(magnitude != 0, kNonZero);
      if (magnitude == 0) return sum;
      const int bits = std::bit_width(magnitude);
      for (int b = 1; b <= bits && b < kMaxBits; ++b) sum += NodeBits(bits > b, kLength + b);
      const auto bit_at = [&](int place) { return ((magnitude >> place) & 1) != 0; };
      if (bits > 1) sum += NodeBits(bit_at(bits - 2), kFirst + bits);
      if (bits > 2) {
        sum += NodeBits(bit_at(bits - 3), kSecond + 2 * bits + (bit_at(bits - 2) ? 1 : 0));
      }
      return sum + (bits > 3 ? bits - 3 : 0);
    }

   private:
    static constexpr int kShared = 8;  // nodes that most magnitudes have in common

    double NodeBits(bool bit, int node) {
      if (node >= kShared) return BitCost(costs_, bit, model_.NodeProbability(node, contexts_));
      int& probability = shared_[static_cast<size_t>(node)];
      if (probability == 0) probability = model_.NodeProbability(node, contexts_);
      return BitCost(costs_, bit, probability);
    }

    const ResidualModel& model_;
    const Contexts& contexts_;
    const std::array<float, 4096>& costs_ = BitCosts();
    std::array<int, kShared> shared_{};  // their probabilities; 0: not asked for yet
  };

 private:
  static constexpr int kNonZero = 0, kSign = 1, kLength = 1, kFirst = kLength + kMaxBits,
                       kSecond = kFirst + kMaxBits + 1, kNodes = kSecond + 2 * kMaxBits + 2;

  size_t PlaceOf(int input, int node, const Contexts& contexts) const {
    return static_cast<size_t>(contexts[input]) * kNodes + node;
  }

  template <typename Coder>
  bool CodeNode(Coder& coder, bool bit, int node, const Contexts& contexts) {
    std::array<BitModel*, kInputs> inputs;
    for (int i = 0; i < kInputs; ++i) inputs[i] = &models_[i][PlaceOf(i, node, contexts)];
    return mixers_[node].Code(coder, bit, inputs, limit_);
  }

  int NodeProbability(int node, const Contexts& contexts) const {
    std::array<const BitModel*, kInputs> inputs;
    for (int i = 0; i < kInputs; ++i) inputs[i] = &models_[i][PlaceOf(i, node, contexts)];
    return mixers_[node].Probability(inputs);
  }

  std::array<std::vector<BitModel>, kInputs> models_;
  std::vector<BitMixer<kInputs>> mixers_;
  int limit_;
};

}  // namespace rilievo
