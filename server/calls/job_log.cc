#include "server/calls/job_log.h"

#include <cstdio>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

std::string Seconds(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3f", value);
  return text;
}

// Printable ASCII without quotes: a client's words must not forge a second line.
std::string Quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c < ' ' || c > '~' || c == '"' || c == '\\' ? '?' : c;
  return result + "\"";
}

}  // namespace

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

}  // namespace rilievo
