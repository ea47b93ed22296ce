// How heights are sampled.
#pragma once

#include "absl/status/status.h"

namespace rilievo {

struct DisplacementOptions {
  // Largest |height| kept, fraction of the diagonal. (0, 0.5].
  double max_height = 0.05;
  // A point takes part only if its normal and the ray agree: n_point . n_ray > this. [-1, 1).
  double min_normal_agreement = 0.2;
  // Points pulled into a vertex's queue before it is given up. [3, 256].
  int max_queue = 24;
  // Longest edge of a virtual triangle, in local spacings. > 1.
  double max_triangle_spacings = 4.0;
  // Above this ratio of local noise to local spacing a local fit replaces the bare triangle; from a
  // third of it on, improves it. >= 0.
  double plane_noise_ratio = 0.15;
  // Rounds of the input-dependent Laplacian (4.4), along the normal. [0, 20].
  int smoothing_rounds = 2;
  absl::Status Validate() const;
};

}  // namespace rilievo
