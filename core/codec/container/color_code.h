// What the coded numbers of colours stand for: a field of the metadata.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "core/codec/bytes/byte_stream.h"

namespace rilievo {

// Red, green and blue, full at 1, are the sum over the channels k of
// number * units[k] * (axes[3 k], axes[3 k + 1], axes[3 k + 2]) / 127.
struct ColorCode {
  std::array<double, 3> units = {};
  std::array<int8_t, 9> axes = {};
  bool is_known() const { return units[0] > 0; }
  Eigen::Matrix3d RgbFromNumbers() const;
};

std::vector<uint8_t> WriteColorCode(const ColorCode& code);
// Not known where the bytes are too few or a unit is not finite and above 0.
ColorCode ReadColorCode(ByteReader& reader);

}  // namespace rilievo
