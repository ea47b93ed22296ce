// A colour as people's files have it.
#pragma once

#include <array>
#include <cstdint>

namespace rilievo {

// Red, green, blue; sRGB (IEC 61966-2-1).
using Rgb = std::array<uint8_t, 3>;

}  // namespace rilievo
