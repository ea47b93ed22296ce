// The waveform of a point of the formats 4 and 5.
#pragma once

#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"

namespace rilievo::laz {

// LASzip's item WAVEPACKET13, version 1. Nobody reads waveforms here, and nothing of one but the
// way its offset was coded is needed for the next.
class WavePacketDecoder {
 public:
  void Skip(ArithmeticDecoder* decoder);

 private:
  // Kinds of offsets: the same and the next to the last need nothing more.
  static constexpr uint32_t kDifference = 2;
  static constexpr uint32_t kWhole = 3;

  SymbolModel descriptors_{256};
  ContextModels offset_kinds_{4, 4};
  uint32_t offset_kind_ = 0;
  IntegerDecoder offsets_{32, 1}, sizes_{32, 1}, returns_{32, 1}, directions_{32, 3};
};

inline void WavePacketDecoder::Skip(ArithmeticDecoder* decoder) {
  decoder->Decode(&descriptors_);
  offset_kind_ = decoder->Decode(&offset_kinds_[offset_kind_]);
  if (offset_kind_ == kDifference) {
    offsets_.Decode(decoder, 0);
  } else if (offset_kind_ == kWhole) {
    decoder->DecodeBits(32);
    decoder->DecodeBits(32);
  }
  sizes_.Decode(decoder, 0);
  returns_.Decode(decoder, 0);
  for (uint32_t axis = 0; axis < 3; ++axis) directions_.Decode(decoder, axis);
}

}  // namespace rilievo::laz
