#include "core/displacement/displacement_options.h"

#include <cmath>

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
  if (max_queue < 3 || max_queue > 256) return refuse("max_queue", max_queue, "[3, 256]");
  if (!(max_triangle_spacings > 1 && std::isfinite(max_triangle_spacings))) {
    return refuse("max_triangle_spacings", max_triangle_spacings, "(1, inf)");
  }
  if (!(plane_noise_ratio >= 0)) return refuse("plane_noise_ratio", plane_noise_ratio, "[0, inf]");
  if (smoothing_rounds < 0 || smoothing_rounds > 20) {
    return refuse("smoothing_rounds", smoothing_rounds, "[0, 20]");
  }
  return absl::OkStatus();
}

}  // namespace rilievo
