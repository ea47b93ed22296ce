// Integers as differences from their predictions.
#pragma once

#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/arithmetic_model.h"

namespace rilievo::laz {

// A difference is coded as the number k of bits of the interval (-2^k, 2^k] that holds it, under a
// context, and its place there: up to 8 bits of it under a model for this k, the others as they
// are. Isenburg 2013, section "Difference coding".
class IntegerDecoder {
 public:
  // `bits`: 32 or 16, of the integers.
  IntegerDecoder(uint32_t bits, size_t contexts);

  // Value minus prediction, modulo 2^bits.
  uint32_t Decode(ArithmeticDecoder* decoder, uint32_t context);

  // k of the last difference: contexts of others follow from it.
  uint32_t magnitude() const { return magnitude_; }

 private:
  ContextModels magnitudes_;
  BitModel smallest_;
  std::vector<std::optional<SymbolModel>> places_;  // by k
  uint32_t magnitude_ = 0;
};

}  // namespace rilievo::laz
