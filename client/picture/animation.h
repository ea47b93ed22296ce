// Pictures one after the other.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/picture/image.h"

namespace rilievo {

// An animated PNG that repeats for ever: browsers play it, everything else shows its first picture.
// All of one size, at least one. `milliseconds`: of each.
absl::StatusOr<std::string> EncodeAnimation(const std::vector<Image>& images, int milliseconds);

}  // namespace rilievo
