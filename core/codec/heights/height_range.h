// Which heights the format holds: what a decoder refuses, and an encoder must not write.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/codec/heights/height_layout.h"

namespace rilievo {

// Largest |height|, and |value| of a coefficient, in units.
inline constexpr int32_t kMaxHeightUnits = 1 << 24;

// What a decoder says of the others.
inline absl::Status HeightOutOfRange() {
  return absl::DataLossError("a height lies outside the range of the format");
}

inline bool InHeightRange(std::span<const int32_t> heights) {
  return std::all_of(heights.begin(), heights.end(), [](int32_t height) {
    return height >= -kMaxHeightUnits && height <= kMaxHeightUnits;
  });
}

// Adds the values of the coefficients behind the first values.size(), in units; false, with some of
// them, when one lies beyond the range.
inline bool AddValues(const Dequantizer& dequantizer, std::span<const int32_t> coefficients,
                      std::vector<int32_t>& values) {
  values.reserve(coefficients.size());
  for (size_t v = values.size(); v < coefficients.size(); ++v) {
    const int64_t value = dequantizer.Value(coefficients[v]);
    if (value < -kMaxHeightUnits || value > kMaxHeightUnits) return false;
    values.push_back(static_cast<int32_t>(value));
  }
  return true;
}

}  // namespace rilievo
