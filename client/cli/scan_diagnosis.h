// What a scan is like, and what to expect of it, before its surface is made.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/scan_setting.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"

namespace rilievo {

// 5 %, 25 %, 50 %, 75 % and 95 % of the values are below these.
using Quantiles = std::array<double, 5>;

struct ScanDiagnosis {
  int64_t points_in = 0, non_finite = 0, duplicates = 0, strays = 0, outliers = 0;
  int64_t island_points = 0, foliage_points = 0, points_used = 0;
  double diagonal = 0;           // scan unit
  std::array<double, 3> size;    // of the bounding box of the points used, scan unit
  Quantiles spacing{}, noise{};  // scan unit
  Quantiles density{};           // points per square unit of the scan, from the spacing

  int64_t stations = 0;        // places that points were seen from
  bool stations_used = false;  // they are believed
  ScanSetting setting = ScanSetting::kUnknown;

  double normal_disagreement = 0;  // share of neighbours whose normals disagree
  double contested = 0;            // share of points whose side is in doubt
  int point_components = 0;        // groups of points that were turned as a whole

  std::string road, road_reason;
  int components = 0, genus = 0, control_faces = 0;  // of the control mesh
  std::vector<double> loop_lengths;                  // its border, longest first, scan unit

  double expected_seconds = 0;  // of the whole reconstruction on this machine
  int64_t expected_bytes_low = 0, expected_bytes_high = 0;  // of the .dss
  int64_t expected_memory = 0;
  std::vector<std::string> advice;  // full sentences, each with a remedy
};

// Runs the stages up to the fit of the domain as a reconstruction with default options does; no
// heights, no coding: what the heights may yet change, openings that show only then, is not
// predicted. `up`: which way is up, for the setting. Errors are those of the stages: a scan that
// cannot become a surface says so here.
absl::StatusOr<ScanDiagnosis> DiagnoseScan(const PointCloud& scan, UpDirection up,
                                           const RunContext& context);

// Lines of at most 80 columns.
std::string DiagnosisText(const ScanDiagnosis& diagnosis);
// One JSON object, the fields by their names.
std::string DiagnosisJson(const ScanDiagnosis& diagnosis, const std::string& scan,
                          const std::string& format);

}  // namespace rilievo
