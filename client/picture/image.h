// A picture in memory, and PNG.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

struct Image {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;  // sRGB, row by row from the top, 3 bytes a pixel

  std::array<uint8_t, 3> pixel(int x, int y) const {
    const size_t at = 3 * (static_cast<size_t>(y) * static_cast<size_t>(width) + x);
    return {rgb[at], rgb[at + 1], rgb[at + 2]};
  }
};

absl::StatusOr<std::string> EncodePng(const Image& image);
absl::StatusOr<Image> DecodePng(std::string_view png);

// Equal images side by side in rows of `columns`; the rest of the last row is white.
Image TileImages(const std::vector<Image>& images, int columns);

}  // namespace rilievo
