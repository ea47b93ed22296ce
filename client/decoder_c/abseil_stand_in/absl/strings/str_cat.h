// absl::StrCat as far as it is used here; numbers read as Abseil writes them (%g with six digits).
#pragma once

#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>

namespace absl {

inline void AppendPiece(std::string_view piece, std::string* text) { text->append(piece); }

template <typename Number, typename = std::enable_if_t<std::is_arithmetic_v<Number>>>
void AppendPiece(Number number, std::string* text) {
  if constexpr (std::is_floating_point_v<Number>) {
    char buffer[32];
    std::snprintf(buffer, sizeof(buffer), "%g", static_cast<double>(number));
    text->append(buffer);
  } else {
    text->append(std::to_string(number));
  }
}

enum PadSpec { kNoPad = 1, kZeroPad2 = 2, kZeroPad4 = 4, kZeroPad8 = 8 };

struct Hex {
  explicit Hex(unsigned long long value_, PadSpec pad_ = kNoPad) : value(value_), pad(pad_) {}
  unsigned long long value;
  PadSpec pad;
};

inline void AppendPiece(const Hex& hex, std::string* text) {
  char buffer[32];
  std::snprintf(buffer, sizeof(buffer), "%0*llx", static_cast<int>(hex.pad), hex.value);
  text->append(buffer);
}

template <typename... Pieces>
void StrAppend(std::string* text, const Pieces&... pieces) {
  (AppendPiece(pieces, text), ...);
}

template <typename... Pieces>
std::string StrCat(const Pieces&... pieces) {
  std::string text;
  StrAppend(&text, pieces...);
  return text;
}

}  // namespace absl
