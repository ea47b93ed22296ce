#include "core/pipeline/coding_error.h"

#include <algorithm>
#include <cmath>

namespace rilievo {

namespace {

constexpr double kShareOfOwn = 0.3;  // sqrt(1 + 0.3^2) = 1.044
// Of an error asked for. Where it cannot be measured: what the surface errs between the points is
// not all in its own error.
constexpr double kAimMeasured = 0.985, kAim = 0.96;
constexpr double kNoiseRoom = 1.12;
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

bool NoiseAllows(double max_error, const ReconstructReport& report) {
  return max_error > kNoiseRoom * report.median_noise;
}

double CodingErrorWithin(double max_error, const ReconstructReport& report, bool measured) {
  const double distance = report.error.across_rms;
  if (measured && distance >= 0 && distance < max_error && NoiseAllows(max_error, report)) {
    const double aim = kAimMeasured * max_error;
    const double least = (max_error * max_error - distance * distance) / 4;
    const double left = std::max(aim * aim - distance * distance, least);
    return std::clamp(std::sqrt(left), kFinest, 10 * kCoarsest);
  }
  const double own = OwnError(report, measured), aim = kAim * max_error;
  const double left = std::sqrt(std::max(0.0, aim * aim - own * own));
  return std::clamp(std::max(left, kShareOfOwn * own), kFinest, 10 * kCoarsest);
}

}  // namespace rilievo
