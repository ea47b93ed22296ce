#include "client/picture/image.h"

#include <png.h>

#include <algorithm>
#include <cstring>

#include "absl/strings/str_cat.h"
#include "client/picture/png_bytes.h"

namespace rilievo {

absl::StatusOr<std::string> EncodePng(const Image& image) {
  return PngBytes(PngPixels::kRgb8, image.width, image.height, image.rgb.data(), image.rgb.size());
}

absl::StatusOr<Image> DecodePng(std::string_view png) {
  png_image header;
  std::memset(&header, 0, sizeof(header));
  header.version = PNG_IMAGE_VERSION;
  if (!png_image_begin_read_from_memory(&header, png.data(), png.size())) {
    return absl::InvalidArgumentError(absl::StrCat("PNG: ", header.message));
  }
  header.format = PNG_FORMAT_RGB;
  Image image{static_cast<int>(header.width), static_cast<int>(header.height), {}};
  image.rgb.resize(PNG_IMAGE_SIZE(header));
  if (!png_image_finish_read(&header, nullptr, image.rgb.data(), 0, nullptr)) {
    return absl::DataLossError(absl::StrCat("PNG: ", header.message));
  }
  return image;
}

Image TileImages(const std::vector<Image>& images, int columns) {
  const int count = static_cast<int>(images.size());
  columns = std::clamp(columns, 1, std::max(1, count));
  const int rows = (count + columns - 1) / columns;
  Image sheet;
  if (count == 0) return sheet;
  const int width = images[0].width, height = images[0].height;
  sheet.width = columns * width;
  sheet.height = rows * height;
  sheet.rgb.assign(3 * static_cast<size_t>(sheet.width) * sheet.height, 255);
  for (int i = 0; i < count; ++i) {
    for (int y = 0; y < height; ++y) {
      const size_t row = static_cast<size_t>(i / columns * height + y) * sheet.width;
      std::copy_n(images[i].rgb.begin() + 3 * static_cast<std::ptrdiff_t>(y) * width, 3 * width,
                  sheet.rgb.begin() + 3 * static_cast<std::ptrdiff_t>(row + i % columns * width));
    }
  }
  return sheet;
}

}  // namespace rilievo
