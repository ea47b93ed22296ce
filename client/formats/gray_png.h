// 16-bit grey PNG with words.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

struct GrayImage {
  int width = 0, height = 0;
  std::vector<uint16_t> samples;  // rows from the top
  // tEXt chunks: keyword (1 to 79 Latin letters) and text, in order.
  std::vector<std::pair<std::string, std::string>> texts;
};

absl::StatusOr<std::string> EncodeGrayPng(const GrayImage& image);

}  // namespace rilievo
