// absl::from_chars of a double; see compat/charconv.
#pragma once

#include <charconv>

namespace absl {

inline std::from_chars_result from_chars(const char* first, const char* last, double& value) {
  return std::from_chars(first, last, value);
}

}  // namespace absl
