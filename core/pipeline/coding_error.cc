#include "core/pipeline/coding_error.h"

#include <algorithm>

namespace rilievo {

double CodingError(const ReconstructReport& report, bool measured) {
  constexpr double kShareOfOwn = 0.3;  // sqrt(1 + 0.3^2) = 1.044
  constexpr double kNoiseLeft = 0.25;
  constexpr double kSpacings = 1.0 / 50;
  constexpr double kFinest = 1e-6, kCoarsest = 1e-2;
  double own = kSpacings * report.median_spacing;
  if (measured) own = std::min(report.error.b_to_a.rms, report.error.b_to_a.p95 / 2);
  // Most of the points' distance is noise that the surface has not followed.
  const double noise = report.median_noise;
  if (own > kNoiseLeft * noise && own < 2 * noise) own = kNoiseLeft * noise;
  return std::clamp(kShareOfOwn * own, kFinest, kCoarsest);
}

}  // namespace rilievo
