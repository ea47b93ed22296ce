#include "core/pipeline/report_warnings.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/str_format.h"
#include "core/control/control_options.h"
#include "core/control/settings.h"
#include "core/pipeline/code_surface.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

double Share(int64_t part, int64_t whole) {
  return whole == 0 ? 0 : static_cast<double>(part) / static_cast<double>(whole);
}

// Which of noise, holes and spacing keeps the surface off the points.
std::string ReasonOf(const ReconstructReport& report) {
  const double points = report.error.b_to_a.rms;
  const std::string noise = absl::StrFormat(
      "the points scatter by %.4f %% around the surface, which does not follow their noise",
      100 * report.median_noise);
  if (!NoiseAllows(report.max_error, report.median_noise)) return noise;
  if (report.heights_filled > 0 &&
      report.error.across_rms > kReportWarnings.mostly_one_way * points) {
    return absl::StrFormat(
        "parts of the surface have no points near them (%.1f %% of its heights are filled in), and "
        "count by their distance from the points",
        100 * Share(report.heights_filled, report.surface_vertices));
  }
  if (report.median_noise > kReportWarnings.mostly_noise * points) return noise;
  return absl::StrFormat(
      "what lies between points that are %.3f %% apart (in the median), at edges, borders and in "
      "detail, is beyond its heights",
      100 * report.median_spacing);
}

std::string UnreachableError(const ReconstructReport& report) {
  if (report.error.across_rms <= 0) {
    return "The error asked for is below what the scan allows: noise and spacing of the points "
           "keep the surface farther from the truth than that.";
  }
  return absl::StrFormat(
      "The error asked for, %.4f %% of the diagonal, is not kept: %.4f %% is reached, and %.4f %% "
      "before coding (RMS across the surface, the larger of both ways): %s.",
      100 * report.max_error, 100 * report.error.across_rms, 100 * report.uncoded_error,
      ReasonOf(report));
}

// Why stations or normals were not believed.
std::string NotBelieved(const SightFigures& figures, const char* name) {
  std::string reason;
  if (!UsableEnough(figures)) {
    reason = absl::StrFormat("only %.0f %% of them have length 1", 100 * figures.usable);
  } else if (!AlignedEnough(figures)) {
    reason = absl::StrFormat(
        "their median cosine with the normals of the points is %.2f, which normals of other points "
        "have",
        figures.alignment);
  } else {
    reason = absl::StrFormat(
        "neighbours that lie on one side of the surface contradict each other about it (%.0f %% of "
        "the votes are left)",
        100 * figures.consistency);
  }
  return absl::StrFormat(
      "The %s of the scan were not used: %s. Correct them, or give --%s use if they are right.",
      name, reason, name);
}

}  // namespace

std::vector<std::string> WarningsOf(const ReconstructReport& report) {
  std::vector<std::string> warnings;
  if (report.error_unreachable) warnings.push_back(UnreachableError(report));
  const double rms = report.error.b_to_a.rms, spacing = report.median_spacing;
  const double unexplained = std::sqrt(std::max(0.0, rms * rms - std::pow(report.median_noise, 2)));
  if (spacing > 0 && unexplained > kReportWarnings.poor_fit_spacings * spacing) {
    warnings.push_back(absl::StrFormat(
        "The points lie %.1f of their spacings (RMS) off the surface: they may not describe a "
        "surface, or it is finer than the control mesh; try more control faces.",
        rms / spacing));
  }
  if (report.close_asked && report.boundary_loops > 0) {
    warnings.push_back(absl::StrFormat(
        "%d border(s) stay open: topology %s keeps %s. Topology arbitrary closes all borders.",
        report.boundary_loops, report.topology,
        report.topology == "planar" ? "the outer border of its sheet"
                                    : "those of its control mesh"));
  }
  if (report.stations.points > 0 && !report.stations.used) {
    warnings.push_back(NotBelieved(report.stations, "stations"));
  }
  if (report.normals.points > 0 && !report.normals.used) {
    warnings.push_back(NotBelieved(report.normals, "normals"));
  }
  if (report.normal_disagreement > kReportWarnings.disagreement_share) {
    warnings.push_back(absl::StrFormat(
        "%.0f %% of neighbouring normals disagree: the surface may be one-sided, or sheets touch.",
        100 * report.normal_disagreement));
  }
  const double filled = Share(report.heights_filled, report.surface_vertices);
  if (filled > kReportWarnings.filled_share) {
    warnings.push_back(
        absl::StrFormat("%.0f %% of the heights had no data and were filled in.", 100 * filled));
  }
  if (report.median_spacing > 0 && report.median_noise > report.median_spacing) {
    warnings.push_back(absl::StrFormat(
        "The noise (%.2f %% of the diagonal) exceeds the spacing of the points (%.2f %%): detail "
        "below the noise is smoothed away.",
        100 * report.median_noise, 100 * report.median_spacing));
  }
  if (report.border_miss > kControlOptions.exact_border) {
    warnings.push_back(
        absl::StrFormat("The border of the surface is not exact: it is up to %.4f %% of the "
                        "diagonal away from that of the mesh; try more control faces.",
                        100 * report.border_miss));
  }
  if (report.colors_left_out) {
    warnings.emplace_back(
        "The colours were left out: even coarse ones do not fit beside the surface into the bytes "
        "asked for. Allow more bytes.");
  }
  if (report.mesh.opened_edges > 0) {
    warnings.push_back(absl::StrFormat(
        "%d edge(s) of the mesh, of more than two triangles or where it meets itself the other way "
        "round, were opened: its pieces are apart there.",
        report.mesh.opened_edges));
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
