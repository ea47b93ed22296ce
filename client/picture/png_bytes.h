// The bytes of a PNG and of its chunks ("PNG Specification (Third Edition)", W3C 2023, section 5).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace rilievo {

// The signature and IHDR, before which no other chunk may stand.
constexpr size_t kPngSignature = 8, kPngHeaderEnd = kPngSignature + 12 + 13;

enum class PngPixels {
  kRgb8,    // three bytes a pixel, sRGB
  kGray16,  // one uint16_t of this machine's order a pixel, linear
};

// `samples`: of all pixels, row by row from the top, as `pixels` says. INVALID_ARGUMENT unless
// there are as many as the size asks for.
absl::StatusOr<std::string> PngBytes(PngPixels pixels, int width, int height, const void* samples,
                                     size_t sample_count);

// The low bytes of `value`, highest first.
std::string BigEndian(uint32_t value, int bytes = 4);

// `type`: four letters.
std::string PngChunk(std::string_view type, std::string_view content);

}  // namespace rilievo
