// The first bytes of a height layer: how its level is transformed and quantised.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/codec/height_lifting.h"

namespace rilievo {

// What a coefficient stands for: its multiple of the step, drawn towards zero by `draw` / 256 of a
// step ([0]: of 1 and -1, [1]: of larger ones), since small magnitudes are likelier.
struct Dequantizer {
  int32_t step = 1;
  std::array<int, 2> draw = {0, 0};
  int64_t Value(int32_t coefficient) const {
    if (coefficient == 0) return 0;
    const int64_t magnitude = std::abs(int64_t{coefficient});
    const int64_t value = magnitude * step - ((int64_t{step} * draw[magnitude > 1 ? 1 : 0]) >> 8);
    return coefficient < 0 ? -value : value;
  }
};

inline constexpr int32_t kMaxHeightStep = 1 << 24;  // units

struct HeightLayout {
  LiftingStep lifting;  // level 0: unused
  bool empty = false;   // no coefficients: all zero
  Dequantizer dequantizer;
  std::span<const uint8_t> coded;  // the rest of the payload
};

// Everything but what is coded.
std::vector<uint8_t> WriteHeightLayout(const HeightLayout& layout);

// DATA_LOSS when a field is missing or out of range.
absl::StatusOr<HeightLayout> ReadHeightLayout(std::span<const uint8_t> payload, int level);

}  // namespace rilievo
