// The LZF compression that PCD's binary_compressed bodies use.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

// No LZF stream grows by more: three bytes make at most 264.
inline constexpr uint64_t kMaxLzfRatio = 88;

// DATA_LOSS when the stream breaks off, refers before its start, or does not give exactly
// `size` bytes. `size` is checked against kMaxLzfRatio before it is allocated.
absl::StatusOr<std::vector<char>> DecodeLzf(std::string_view compressed, uint64_t size);

// A plain encoder: greedy matches by a table of three-byte hashes.
std::vector<char> EncodeLzf(std::string_view bytes);

}  // namespace rilievo
