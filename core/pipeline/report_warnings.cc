#include "core/pipeline/report_warnings.h"

#include "absl/strings/str_format.h"

namespace rilievo {
namespace {

// Thresholds beyond which a figure deserves a sentence.
constexpr double kPoorFitSpacings = 2.0;     // two-sided RMS, in median spacings
constexpr double kFilledShare = 0.2;         // of all heights
constexpr double kDisagreementShare = 0.05;  // of neighbouring normals
constexpr double kNoiseSpacings = 1.0;       // median noise, in median spacings

double Share(int64_t part, int64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

std::vector<std::string> WarningsOf(const ReconstructReport& report) {
  std::vector<std::string> warnings;
  if (report.error_unreachable) {
    warnings.push_back(
        "The error asked for is below what the scan allows: noise and spacing of the points keep "
        "the surface farther from the truth than that.");
  }
  const double rms_spacings =
      report.median_spacing > 0 ? report.error.rms / report.median_spacing : 0;
  if (rms_spacings > kPoorFitSpacings) {
    warnings.push_back(absl::StrFormat(
        "The surface lies %.1f point spacings (RMS) off the scan: the points may not describe a "
        "surface, or it is finer than the control mesh; try more control faces.",
        rms_spacings));
  }
  if (report.normal_disagreement > kDisagreementShare) {
    warnings.push_back(absl::StrFormat(
        "%.0f %% of neighbouring normals disagree: the surface may be one-sided, or sheets touch.",
        100 * report.normal_disagreement));
  }
  const double filled = Share(report.heights_filled, report.surface_vertices);
  if (filled > kFilledShare) {
    warnings.push_back(
        absl::StrFormat("%.0f %% of the heights had no data and were filled in.", 100 * filled));
  }
  if (report.median_spacing > 0 && report.median_noise > kNoiseSpacings * report.median_spacing) {
    warnings.push_back(absl::StrFormat(
        "The noise (%.2f %% of the diagonal) exceeds the spacing of the points (%.2f %%): detail "
        "below the noise is smoothed away.",
        100 * report.median_noise, 100 * report.median_spacing));
  }
  if (report.strays > 0) {
    warnings.push_back(
        absl::StrFormat("%d point(s) extremely far from all others were left out.", report.strays));
  }
  if (report.non_finite > 0) {
    warnings.push_back(
        absl::StrFormat("%d point(s) with NaN or infinity were left out.", report.non_finite));
  }
  return warnings;
}

}  // namespace rilievo
