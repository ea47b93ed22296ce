// absl::from_chars of a double; for WebAssembly see client/web/wasm/compat/charconv.
#pragma once

#include <charconv>

namespace absl {

inline std::from_chars_result from_chars(const char* first, const char* last, double& value) {
  return std::from_chars(first, last, value);
}

}  // namespace absl
