// Lower case of ASCII letters; see str_cat.h.
#pragma once

#include <string>
#include <string_view>

namespace absl {

inline std::string AsciiStrToLower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return lower;
}

}  // namespace absl
