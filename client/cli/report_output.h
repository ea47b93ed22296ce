// The report of a reconstruction for people and for programs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/alignment_words.h"
#include "client/cli/surface_output.h"
#include "rilievo/v1/report.pb.h"

namespace rilievo {

struct ReportPaths {
  std::string scan, scan_format;
  SurfaceTarget target;
  std::vector<std::string> merged = {};           // the files of a merged scan
  std::optional<AlignmentReport> alignment = {};  // of these
};

// Lines of at most 80 columns.
std::string ReportText(const v1::ReconstructReport& report, const ReportPaths& paths);

// One JSON object: the report's fields by their names in report.proto, stage times by stage.
std::string ReportJson(const v1::ReconstructReport& report, const ReportPaths& paths);

// The report as a line of a list, wrapped.
std::string ReportLine(const v1::ReconstructReport& report, const ReportPaths& paths);

// What stands for a report where there is none: scan, output, error.code and error.message.
std::string FailureJson(const absl::Status& status, const ReportPaths& paths);

// "control-mesh" for STAGE_CONTROL_MESH.
std::string StageLabel(v1::Stage stage);

}  // namespace rilievo
