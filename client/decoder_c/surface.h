// What stands behind a RilievoSurface.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"
#include "core/codec/container/dss.h"

struct RilievoSurface {
  rilievo::DecodedSurface decoded;
  std::string info;                   // JSON
  std::array<double, 4> frame{};      // centre, diagonal
  Eigen::Matrix3Xd control_vertices;  // scan frame
  Eigen::Matrix<uint32_t, 2, Eigen::Dynamic> crease_ends;
  std::vector<float> sharpness;
};

namespace rilievo::decoder_c {

// For C; the caller frees it.
RilievoSurface* WrapSurface(DecodedSurface decoded);

// What rilievo_surface_info() gives.
std::string InfoJson(const DecodedSurface& decoded);
// Its "place".
std::string PlaceJson(const ScanPlace& place);

// Colours as C sees them.
inline const uint8_t* BytesOf(const std::vector<Rgb>& colors, size_t* count) {
  static_assert(sizeof(Rgb) == 3);
  if (count != nullptr) *count = 3 * colors.size();
  return colors.empty() ? nullptr : colors.front().data();
}

// The memory of non-negative ints as C sees it.
inline const uint32_t* AsUnsigned(const int* values) {
  static_assert(sizeof(int) == sizeof(uint32_t));
  return reinterpret_cast<const uint32_t*>(values);
}

}  // namespace rilievo::decoder_c
