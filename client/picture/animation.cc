// "PNG Specification (Third Edition)", W3C 2023, 11.3.6: acTL, fcTL, fdAT.
#include "client/picture/animation.h"

#include <zlib.h>

#include <cstdint>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr size_t kSignature = 8, kHeaderEnd = kSignature + 12 + 13;  // with the chunk IHDR

std::string Big(uint32_t value, int bytes = 4) {
  std::string text;
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) {
    text += static_cast<char>(value >> shift & 0xff);
  }
  return text;
}

uint32_t BigAt(std::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

std::string Chunk(const std::string& type, const std::string& content) {
  const std::string checked = absl::StrCat(type, content);
  const auto crc = static_cast<uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size())));
  return absl::StrCat(Big(static_cast<uint32_t>(content.size())), checked, Big(crc));
}

// The chunks IDAT of a PNG of ours, their contents joined.
std::string PictureData(std::string_view png) {
  std::string data;
  for (size_t at = kSignature; at + 12 <= png.size();) {
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
      animation = absl::StrCat(png.substr(0, kHeaderEnd),
                               Chunk("acTL", Big(static_cast<uint32_t>(images.size())) + Big(0)));
    }
    animation += Chunk(
        "fcTL", absl::StrCat(Big(sequence++), Big(static_cast<uint32_t>(images[i].width)),
                             Big(static_cast<uint32_t>(images[i].height)), Big(0), Big(0),
                             Big(static_cast<uint32_t>(milliseconds), 2), Big(1000, 2), Big(0, 2)));
    const std::string data = PictureData(png);
    animation += i == 0 ? Chunk("IDAT", data) : Chunk("fdAT", Big(sequence++) + data);
  }
  return animation + Chunk("IEND", "");
}

}  // namespace rilievo
