// Rows that EXT_meshopt_compression has packed.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"

namespace rilievo {

struct PackedRows {
  std::string_view bytes;
  uint64_t rows = 0;
  uint64_t stride = 0;  // bytes of a row
  std::string mode;     // "ATTRIBUTES", "TRIANGLES" or "INDICES"
  std::string filter = "NONE";
};

// rows * stride bytes, by libmeshoptimizer's decoders, which are made for bytes that nobody can
// trust. INVALID_ARGUMENT for a mode, filter or stride that the extension does not have, and for
// more rows than so few bytes can hold; DATA_LOSS for bytes that do not decode.
absl::StatusOr<std::string> UnpackRows(const PackedRows& packed);

}  // namespace rilievo
