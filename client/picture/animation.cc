// "PNG Specification (Third Edition)", W3C 2023, 11.3.6: acTL, fcTL, fdAT.
#include "client/picture/animation.h"

#include <cstdint>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "client/picture/png_bytes.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

uint32_t BigAt(std::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

// The chunks IDAT of a PNG of ours, their contents joined.
std::string PictureData(std::string_view png) {
  std::string data;
  for (size_t at = kPngSignature; at + 12 <= png.size();) {
    const uint32_t size = BigAt(png, at);
    if (png.substr(at + 4, 4) == "IDAT") data += png.substr(at + 8, size);
    at += 12 + size;
  }
  return data;
}

}  // namespace

absl::StatusOr<std::string> EncodeAnimation(const std::vector<Image>& images, int milliseconds) {
  if (images.empty()) return absl::InvalidArgumentError("an animation of no pictures");
  std::string animation;
  uint32_t sequence = 0;
  for (size_t i = 0; i < images.size(); ++i) {
    if (images[i].width != images[0].width || images[i].height != images[0].height) {
      return absl::InvalidArgumentError("the pictures of an animation must be of one size");
    }
    RILIEVO_ASSIGN_OR_RETURN(const std::string png, EncodePng(images[i]));
    if (i == 0) {
      animation = absl::StrCat(
          png.substr(0, kPngHeaderEnd),
          PngChunk("acTL", BigEndian(static_cast<uint32_t>(images.size())) + BigEndian(0)));
    }
    animation += PngChunk(
        "fcTL",
        absl::StrCat(BigEndian(sequence++), BigEndian(static_cast<uint32_t>(images[i].width)),
                     BigEndian(static_cast<uint32_t>(images[i].height)), BigEndian(0), BigEndian(0),
                     BigEndian(static_cast<uint32_t>(milliseconds), 2), BigEndian(1000, 2),
                     BigEndian(0, 2)));
    const std::string data = PictureData(png);
    animation += i == 0 ? PngChunk("IDAT", data) : PngChunk("fdAT", BigEndian(sequence++) + data);
  }
  return animation + PngChunk("IEND", "");
}

}  // namespace rilievo
