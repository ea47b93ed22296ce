#include "core/pipeline/coding_error.h"

#include <algorithm>
#include <cmath>

namespace rilievo {

namespace {

constexpr double kShareOfOwn = 0.3;  // sqrt(1 + 0.3^2) = 1.044
// Of an error asked for: what the surface errs between the points is not all in its own error.
constexpr double kAim = 0.96;
constexpr double kFinest = 1e-6, kCoarsest = 1e-2;

}  // namespace

double OwnError(const ReconstructReport& report, bool measured) {
  constexpr double kNoiseLeft = 0.25;
  constexpr double kSpacings = 1.0 / 80;
  double own = kSpacings * report.median_spacing;
  if (measured) own = std::max(own, std::min(report.error.b_to_a.rms, report.error.b_to_a.p95 / 2));
  // Most of the points' distance is noise that the surface has not followed.
  const double noise = report.median_noise;
  if (own > kNoiseLeft * noise && own < 2 * noise) own = kNoiseLeft * noise;
  return own;
}

double CodingError(const ReconstructReport& report, bool measured) {
  return std::clamp(kShareOfOwn * OwnError(report, measured), kFinest, kCoarsest);
}

double CodingErrorWithin(double max_error, const ReconstructReport& report, bool measured) {
  const double own = OwnError(report, measured), aim = kAim * max_error;
  const double left = std::sqrt(std::max(0.0, aim * aim - own * own));
  return std::clamp(std::max(left, kShareOfOwn * own), kFinest, 10 * kCoarsest);
}

}  // namespace rilievo
