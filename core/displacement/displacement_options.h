// How heights are sampled.
#pragma once

#include "absl/status/status.h"

namespace rilievo {

struct DisplacementOptions {
  // Largest |height| kept, fraction of the diagonal. (0, 0.5].
  double max_height = 0.05;
  // A point takes part only if its normal and that of the domain below it agree: n_point . n >
  // this.
  // [-1, 1).
  double min_normal_agreement = 0.2;
  absl::Status Validate() const;
};

}  // namespace rilievo
