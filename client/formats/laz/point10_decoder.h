// The first 20 bytes of a point of the formats 0 to 5.
#pragma once

#include <array>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"
#include "client/formats/laz/place_decoder.h"

namespace rilievo::laz {

// LASzip's item POINT10, version 2 (Isenburg 2013, section "Compressing point10").
class Point10Decoder {
 public:
  // `first`: the first record of the chunk, which is not compressed.
  explicit Point10Decoder(const char* first);

  // Writes x, y, z, intensity, returns, flags and classification of the next point into `record`.
  // Scan angle, user data and source stay as they are there: nobody reads them.
  void Decode(ArithmeticDecoder* decoder, char* record);

 private:
  // What is not a coordinate, as far as it changed.
  void DecodeAttributes(ArithmeticDecoder* decoder, uint32_t changed);

  uint32_t number() const { return returns_ & 7u; }
  uint32_t count() const { return (returns_ >> 3) & 7u; }

  uint32_t x_, y_;  // modulo 2^32
  uint16_t intensity_ = 0;
  uint8_t returns_, classification_, user_data_;

  SymbolModel changed_{64};
  ContextModels returns_models_{256, 256}, classifications_{256, 256}, user_data_models_{256, 256};
  ContextModels scan_angles_{2, 256};
  IntegerDecoder intensities_{16, 4}, sources_{16, 1};
  PlaceDecoder place_{0};
  std::array<uint16_t, 16> last_intensities_{};  // by return context
};

}  // namespace rilievo::laz
