#include "client/formats/laz/integer_decoder.h"

#include <algorithm>

namespace rilievo::laz {
namespace {

constexpr uint32_t kModelledBits = 8;

}  // namespace

IntegerDecoder::IntegerDecoder(uint32_t bits, size_t contexts)
    : magnitudes_(contexts, bits + 1), places_(size_t{bits} + 1) {}

uint32_t IntegerDecoder::Decode(ArithmeticDecoder* decoder, uint32_t context) {
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
