// Which return of a pulse a point is, as a context for the rest of it.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace rilievo::laz {

// A function of n, the number of returns of the pulse, and r, the number of this one, both below
// `numbers`. It is symmetric, since files mix the two up.
template <size_t numbers>
class ReturnTable {
 public:
  constexpr explicit ReturnTable(uint32_t (*value)(uint32_t low, uint32_t high)) {
    for (uint32_t n = 0; n < numbers; ++n) {
      for (uint32_t r = 0; r < numbers; ++r) {
        values_[n][r] = static_cast<uint8_t>(value(std::min(n, r), std::max(n, r)));
      }
    }
  }
  constexpr uint32_t operator()(uint32_t n, uint32_t r) const { return values_[n][r]; }

 private:
  std::array<std::array<uint8_t, numbers>, numbers> values_{};
};

// Formats 0 to 5: 0 to 15, one for each return of pulses with up to five.
inline constexpr ReturnTable<8> kReturnContexts([](uint32_t low, uint32_t high) {
  return low > 0 && high <= 5 ? high * (high - 1) / 2 + low - 1 : 15 - high + low;
});

// Formats 6 to 10: 0 to 5.
inline constexpr ReturnTable<16> kFewReturnContexts([](uint32_t low, uint32_t high) -> uint32_t {
  if (low == 0) return high < 6 ? high : high == 6 ? 3 : high < 9 ? 4 : 5;
  if (high <= 2) return high + low - 2;
  if (low == 1 || (low == 2 && high > 10)) return 3;
  const bool last = low == high || (low > 10 && high == low + 1);
  return last && low > 2 ? 5 : 4;
});

// How many returns lie between this one and the last: which surface it may be of.
inline constexpr ReturnTable<16> kReturnLevels([](uint32_t low, uint32_t high) {
  return std::min(high - low, 7u);
});

}  // namespace rilievo::laz
