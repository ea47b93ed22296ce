// The red, green and blue of a point.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/record_fields.h"

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

inline Color Color::LoadFrom(const char* bytes) {
  return {{Load<uint16_t>(bytes), Load<uint16_t>(bytes + 2), Load<uint16_t>(bytes + 4)}};
}

inline void Color::StoreTo(char* bytes) const {
  for (size_t channel = 0; channel < 3; ++channel) Store(channels[channel], bytes + 2 * channel);
}

inline Color ColorDecoder::Decode(ArithmeticDecoder* decoder, const Color& last) {
  const uint32_t changed = decoder->Decode(&changed_);
  // Models and bits are in the order low and high byte of red, of green, of blue.
  const auto decode_byte = [&](uint32_t index, int predicted, int unchanged) -> int {
    if ((changed >> index & 1) == 0) return unchanged;
    return (static_cast<uint32_t>(std::clamp(predicted, 0, 255)) +
            decoder->Decode(&bytes_[index])) &
           0xff;
  };
  const auto last_byte = [&](size_t channel, uint32_t high) {
    return last.channels[channel] >> (8 * high) & 0xff;
  };
  std::array<std::array<int, 2>, 3> bytes;
  for (const uint32_t high : {0u, 1u}) {
    bytes[0][high] = decode_byte(high, last_byte(0, high), last_byte(0, high));
  }
  for (const uint32_t high : {0u, 1u}) {
    if ((changed & 64) == 0) {
      bytes[1][high] = bytes[2][high] = bytes[0][high];
      continue;
    }
    const int red_change = bytes[0][high] - last_byte(0, high);
    const int green = last_byte(1, high), blue = last_byte(2, high);
    bytes[1][high] = decode_byte(2 + high, green + red_change, green);
    const int change = (red_change + bytes[1][high] - green) / 2;
    bytes[2][high] = decode_byte(4 + high, blue + change, blue);
  }
  Color color;
  for (size_t channel = 0; channel < 3; ++channel) {
    color.channels[channel] = static_cast<uint16_t>(bytes[channel][1] << 8 | bytes[channel][0]);
  }
  return color;
}

}  // namespace rilievo::laz
