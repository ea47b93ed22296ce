// What the coded numbers of colours stand for: a field of the metadata.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "core/codec/bytes/byte_stream.h"
#include "core/geometry/rgb.h"

namespace rilievo {

// Red, green and blue, full at 1, are the sum over the channels k of
// number * units[k] * (axes[3 k], axes[3 k + 1], axes[3 k + 2]) / 127. Units are at most 1.
struct ColorCode {
  std::array<double, 3> units = {};
  std::array<int8_t, 9> axes = {};
  bool is_known() const { return units[0] > 0; }
  Eigen::Matrix3d RgbFromNumbers() const;
};

// Colours of a channel's numbers, each below 2^24 in size, the same on every machine.
class ColorDecoder {
 public:
  explicit ColorDecoder(const ColorCode& code);
  Rgb ColorOf(const std::array<int32_t, 3>& numbers) const;

 private:
  std::array<int64_t, 9> weights_;  // of channel k in red, green, blue: 3 k and on; 2^-24 of a byte
};

std::vector<uint8_t> WriteColorCode(const ColorCode& code);
// Not known where the bytes are too few or a unit is out of range.
ColorCode ReadColorCode(ByteReader& reader);

}  // namespace rilievo
