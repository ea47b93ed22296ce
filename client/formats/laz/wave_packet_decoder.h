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
  SymbolModel descriptors_{256};
  ContextModels offset_kinds_{4, 4};
  uint32_t offset_kind_ = 0;
  IntegerDecoder offsets_{32, 1}, sizes_{32, 1}, returns_{32, 1}, directions_{32, 3};
};

}  // namespace rilievo::laz
