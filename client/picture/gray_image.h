// 16-bit grey pictures with words.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

struct GrayImage {
  int width = 0, height = 0;
  std::vector<uint16_t> samples;  // linear, row by row from the top
  // tEXt chunks: keyword (1 to 79 Latin letters) and text, in order.
  std::vector<std::pair<std::string, std::string>> texts;
};

absl::StatusOr<std::string> EncodePng(const GrayImage& image);

}  // namespace rilievo
