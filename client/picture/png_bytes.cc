#include "client/picture/png_bytes.h"

#include <png.h>
#include <zlib.h>

#include <cstring>

#include "absl/strings/str_cat.h"

namespace rilievo {

absl::StatusOr<std::string> PngBytes(PngPixels pixels, int width, int height, const void* samples,
                                     size_t sample_count) {
  const size_t channels = pixels == PngPixels::kRgb8 ? 3 : 1;
  if (width <= 0 || height <= 0 ||
      sample_count != channels * static_cast<size_t>(width) * static_cast<size_t>(height)) {
    return absl::InvalidArgumentError(absl::StrCat("an image of ", width, " x ", height, " with ",
                                                   sample_count, " samples cannot be written"));
  }
  png_image header;
  std::memset(&header, 0, sizeof(header));
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(width);
  header.height = static_cast<png_uint_32>(height);
  header.format = pixels == PngPixels::kRgb8 ? PNG_FORMAT_RGB : PNG_FORMAT_LINEAR_Y;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string png(size, '\0');
  if (!png_image_write_to_memory(&header, png.data(), &size, 0, samples, 0, nullptr)) {
    return absl::InternalError(absl::StrCat("PNG: ", header.message));
  }
  png.resize(size);
  return png;
}

std::string BigEndian(uint32_t value, int bytes) {
  std::string text;
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) {
    text += static_cast<char>(value >> shift & 0xff);
  }
  return text;
}

std::string PngChunk(std::string_view type, std::string_view content) {
  std::string checked(type);
  checked += content;
  const auto crc = static_cast<uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size())));
  return absl::StrCat(BigEndian(static_cast<uint32_t>(content.size())), checked, BigEndian(crc));
}

}  // namespace rilievo
