#include "server/observability/job_log.h"

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "server/observability/event_line.h"

namespace rilievo {
namespace {

std::string Seconds(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3f", value);
  return text;
}

}  // namespace

std::vector<std::pair<std::string, double>> SecondsByStage(const v1::ReconstructReport& report) {
  std::vector<std::pair<std::string, double>> stages;
  for (const v1::StageTime& time : report.stage_times()) {
    stages.emplace_back(
        absl::AsciiStrToLower(absl::StripPrefix(v1::Stage_Name(time.stage()), "STAGE_")),
        time.seconds());
  }
  return stages;
}

std::string JobLine(const JobRecord& record) {
  std::string line = absl::StrCat(
      "job=", record.job, " status=", absl::StatusCodeToString(record.code),
      " points=", record.points_announced, " bytes_in=", record.bytes_in,
      " bytes_out=", record.bytes_out, " upload_s=", Seconds(record.upload_seconds),
      " queue_s=", Seconds(record.queue_seconds), " work_s=", Seconds(record.work_seconds),
      " total_s=", Seconds(record.total_seconds));
  if (!record.id.empty()) absl::StrAppend(&line, " id=", record.id);
  if (!record.road.empty()) absl::StrAppend(&line, " road=", record.road);
  if (!record.detail.empty()) absl::StrAppend(&line, " detail=", Quoted(record.detail));
  return line;
}

std::string JobJson(const JobRecord& record, const std::string& time) {
  const auto seconds = [](double value) { return std::round(value * 1000) / 1000; };
  nlohmann::ordered_json json = {{"time", time},
                                 {"event", "job"},
                                 {"job", record.job},
                                 {"status", absl::StatusCodeToString(record.code)},
                                 {"points", record.points_announced},
                                 {"bytes_in", record.bytes_in},
                                 {"bytes_out", record.bytes_out},
                                 {"peak_bytes", record.peak_bytes},
                                 {"estimated_bytes", record.estimated_bytes},
                                 {"upload_s", seconds(record.upload_seconds)},
                                 {"queue_s", seconds(record.queue_seconds)},
                                 {"work_s", seconds(record.work_seconds)},
                                 {"total_s", seconds(record.total_seconds)}};
  for (const char* memory : {"peak_bytes", "estimated_bytes"}) {
    if (json[memory] == 0) json.erase(memory);
  }
  for (const auto& [name, value] :
       {std::pair("id", &record.id), std::pair("owner", &record.owner),
        std::pair("road", &record.road), std::pair("trace_id", &record.trace_id),
        std::pair("parent_id", &record.parent_id), std::pair("detail", &record.detail)}) {
    if (!value->empty()) json[name] = *value;
  }
  for (const auto& [stage, value] : record.stage_seconds) json["stages"][stage] = seconds(value);
  // Words of a client may be no UTF-8.
  return json.dump(-1, ' ', /*ensure_ascii=*/true,
                   nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace rilievo
