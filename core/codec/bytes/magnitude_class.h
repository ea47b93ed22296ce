// Logarithmic classes of magnitudes, for contexts.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>

namespace rilievo {

// Class of a magnitude given in quarters: two classes an octave, at most `last`. 0, 1, 2, 3 are
// their own classes, 4 and 5 quarters class 4, 6 and 7 class 5, 8 to 11 class 6, ...
inline int MagnitudeClass(int64_t quarters, int last) {
  if (quarters < 4) return std::min(static_cast<int>(quarters), last);
  const int octave = std::bit_width(static_cast<uint64_t>(quarters)) - 1;
  const int upper_half = static_cast<int>((quarters >> (octave - 1)) & 1);
  return std::min(last, 2 * octave + upper_half);
}

}  // namespace rilievo
