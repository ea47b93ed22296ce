// absl::StrJoin of strings; see str_cat.h.
#pragma once

#include <string>
#include <string_view>

#include "absl/strings/str_cat.h"

namespace absl {

template <typename Range>
std::string StrJoin(const Range& pieces, std::string_view separator) {
  std::string text;
  bool first = true;
  for (const auto& piece : pieces) {
    if (!first) text.append(separator);
    first = false;
    StrAppend(&text, piece);
  }
  return text;
}

}  // namespace absl
