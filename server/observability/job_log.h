// One line a job, for the operator.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "rilievo/v1/report.pb.h"

namespace rilievo {

// What one call of Reconstruct, or one kept job, came to.
struct JobRecord {
  uint64_t job = 0;
  std::string id;                                 // of a kept job; else empty
  std::string owner;                              // by token or certificate; may be empty
  absl::StatusCode code = absl::StatusCode::kOk;  // as sent to the client
  std::string detail;                             // the cause, the core's own words; empty when OK
  int64_t points_announced = 0;
  int64_t bytes_in = 0, bytes_out = 0;
  double upload_seconds = 0, queue_seconds = 0, work_seconds = 0, total_seconds = 0;
  int64_t peak_bytes = 0, estimated_bytes = 0;  // of memory, see PeakBytes(); 0: not known
  std::string road;
  std::vector<std::pair<std::string, double>> stage_seconds;  // by name, in order; when OK
  std::string trace_id, parent_id;                            // of the caller; may be empty
};

// Must be callable from many threads.
using JobLog = std::function<void(const JobRecord&)>;

// By name, "check" of STAGE_CHECK; as JobRecord::stage_seconds.
std::vector<std::pair<std::string, double>> SecondsByStage(const v1::ReconstructReport& report);

// "job=7 status=OK points=100000 ...", without a line end. One line whatever `detail` holds.
std::string JobLine(const JobRecord& record);

// The same and more as a JSON object on one line: event "job", then job, id, owner, status, points,
// bytes_in, bytes_out, peak_bytes, estimated_bytes, upload_s, queue_s, work_s, total_s, road,
// stages, trace_id, parent_id, detail. `time`: ISO 8601, comes first. What is empty is left out.
std::string JobJson(const JobRecord& record, const std::string& time);

}  // namespace rilievo
