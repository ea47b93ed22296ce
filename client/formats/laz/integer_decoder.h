// Integers as differences from their predictions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/arithmetic_model.h"

namespace rilievo::laz {

// A difference is coded as the number k of bits of the interval (-2^k, 2^k] that holds it, under a
// context, and its place there: up to 8 bits of it under a model for this k, the others as they
// are. Isenburg 2013, section "Difference coding".
class IntegerDecoder {
 public:
  // `bits`: 32 or 16, of the integers.
  IntegerDecoder(uint32_t bits, size_t contexts)
      : magnitudes_(contexts, bits + 1), places_(size_t{bits} + 1) {}

  // Value minus prediction, modulo 2^bits.
  uint32_t Decode(ArithmeticDecoder* decoder, uint32_t context);

  // k of the last difference: contexts of others follow from it.
  uint32_t magnitude() const { return magnitude_; }

 private:
  static constexpr uint32_t kModelledBits = 8;

  ContextModels magnitudes_;
  BitModel smallest_;
  std::vector<std::optional<SymbolModel>> places_;  // by k
  uint32_t magnitude_ = 0;
};

inline uint32_t IntegerDecoder::Decode(ArithmeticDecoder* decoder, uint32_t context) {
  const uint32_t k = decoder->Decode(&magnitudes_[context]);
  magnitude_ = k;
  if (k == 0) return decoder->DecodeBit(&smallest_);
  if (k == 32) return 1u << 31;
  std::optional<SymbolModel>& model = places_[k];
  if (!model) model.emplace(1u << std::min(k, kModelledBits));
  uint32_t place = decoder->Decode(&*model);
  if (k > kModelledBits) {
    const auto low_bits = static_cast<int>(k - kModelledBits);
    place = place << low_bits | decoder->DecodeBits(low_bits);
  }
  // The lower half of the places is negative; 0 and 1 belong to smaller k.
  return place >= 1u << (k - 1) ? place + 1 : place - ((1u << k) - 1);
}

}  // namespace rilievo::laz
