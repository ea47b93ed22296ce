#include "core/displacement/displacement_options.h"

#include "absl/strings/str_cat.h"

namespace rilievo {

absl::Status DisplacementOptions::Validate() const {
  const auto refuse = [](const char* name, double value, const char* range) {
    return absl::InvalidArgumentError(
        absl::StrCat("displacement.", name, " is ", value, "; it must be in ", range));
  };
  if (!(max_height > 0 && max_height <= 0.5)) return refuse("max_height", max_height, "(0, 0.5]");
  if (!(min_normal_agreement >= -1 && min_normal_agreement < 1)) {
    return refuse("min_normal_agreement", min_normal_agreement, "[-1, 1)");
  }
  return absl::OkStatus();
}

}  // namespace rilievo
