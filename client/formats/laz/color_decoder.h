// The red, green and blue of a point.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/formats/laz/arithmetic_decoder.h"

namespace rilievo::laz {

struct Color {
  std::array<uint16_t, 3> channels{};

  static Color LoadFrom(const char* bytes);
  void StoreTo(char* bytes) const;
};

// LASzip's item RGB12, version 2, and each scanner channel of RGB14 and RGBNIR14: both bytes of
// each channel, green and blue from the change of red (Isenburg 2013, section "Compressing rgb12").
class ColorDecoder {
 public:
  // The colour after `last`.
  Color Decode(ArithmeticDecoder* decoder, const Color& last);

 private:
  SymbolModel changed_{128};  // a bit for each byte, and one where the colour is not a grey
  ContextModels bytes_{6, 256};
};

}  // namespace rilievo::laz
