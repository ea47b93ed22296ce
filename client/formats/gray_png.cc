#include "client/formats/gray_png.h"

#include <png.h>

#include <cstring>
#include <string_view>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

// Signature and IHDR, before which nothing may stand.
constexpr size_t kBeginning = 8 + 25;

void AppendBig(uint32_t value, std::string* bytes) {
  for (int shift = 24; shift >= 0; shift -= 8) *bytes += static_cast<char>(value >> shift);
}

// CRC-32 of PNG (ISO 3309), bit by bit: the texts are short.
uint32_t Crc(std::string_view bytes) {
  uint32_t crc = 0xffffffff;
  for (const char byte : bytes) {
    crc ^= static_cast<uint8_t>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc;
}

std::string TextChunk(const std::string& keyword, const std::string& text) {
  std::string chunk;
  AppendBig(static_cast<uint32_t>(keyword.size() + 1 + text.size()), &chunk);
  const std::string body = "tEXt" + keyword + std::string(1, '\0') + text;
  chunk += body;
  AppendBig(Crc(body), &chunk);
  return chunk;
}

}  // namespace

absl::StatusOr<std::string> EncodeGrayPng(const GrayImage& image) {
  if (image.width <= 0 || image.height <= 0 ||
      image.samples.size() != static_cast<size_t>(image.width) * image.height) {
    return absl::InvalidArgumentError(absl::StrCat("an image of ", image.width, " x ", image.height,
                                                   " with ", image.samples.size(),
                                                   " samples cannot be written"));
  }
  png_image header;
  std::memset(&header, 0, sizeof(header));
  header.version = PNG_IMAGE_VERSION;
  header.width = static_cast<png_uint_32>(image.width);
  header.height = static_cast<png_uint_32>(image.height);
  header.format = PNG_FORMAT_LINEAR_Y;
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(header);
  std::string png(size, '\0');
  if (!png_image_write_to_memory(&header, png.data(), &size, 0, image.samples.data(), 0, nullptr)) {
    return absl::InternalError(absl::StrCat("PNG: ", header.message));
  }
  png.resize(size);
  std::string texts;
  for (const auto& [keyword, text] : image.texts) texts += TextChunk(keyword, text);
  png.insert(kBeginning, texts);
  return png;
}

}  // namespace rilievo
