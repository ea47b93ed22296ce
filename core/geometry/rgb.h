// A colour as people's files have it.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace rilievo {

// Red, green, blue; sRGB (IEC 61966-2-1).
using Rgb = std::array<uint8_t, 3>;

// Linear light, 0 to 1, of a channel of sRGB, 0 to 1.
inline double LinearFromSrgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

}  // namespace rilievo
