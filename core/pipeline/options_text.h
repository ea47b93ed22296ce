// The options of a reconstruction as one line of text, for the file that comes of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/pipeline/reconstruct.h"

namespace rilievo {

// "name=value" of everything that shapes the surface and is not at its default, divided by blanks:
// empty when nothing was asked for. Numbers come back as they were. A given control mesh is named
// and not repeated. `parts`: of ReconstructPaged(); unset: made in memory.
std::string OptionsText(const ReconstructOptions& options, uint64_t seed,
                        const std::optional<PartSizes>& parts = std::nullopt);

struct StatedOptions {
  ReconstructOptions options;
  uint64_t seed = 0;
  std::optional<PartSizes> parts;  // unset: made in memory
};

// Back again. INVALID_ARGUMENT that names a word it does not know; such text may be of a newer
// version.
absl::StatusOr<StatedOptions> ReadOptionsText(absl::string_view text);

}  // namespace rilievo
