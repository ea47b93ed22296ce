// Which points take part in the heights, and how large these may be.
#pragma once

#include "absl/status/status.h"

namespace rilievo {

struct DisplacementOptions {
  // Largest |height| kept, fraction of the diagonal. (0, 0.5].
  double max_height = 0.05;
  // A point takes part only if the cosine between its normal and that of the domain below it is
  // above this. [-1, 1).
  double min_normal_agreement = 0.2;
  absl::Status Validate() const;
};

}  // namespace rilievo
