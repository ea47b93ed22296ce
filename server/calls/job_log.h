// One line a job, for the operator.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "absl/status/status.h"

namespace rilievo {

// What one call of Reconstruct, or one kept job, came to.
struct JobRecord {
  uint64_t job = 0;
  std::string id;                                 // of a kept job; else empty
  absl::StatusCode code = absl::StatusCode::kOk;  // as sent to the client
  std::string detail;                             // the cause, the core's own words; empty when OK
  int64_t points_announced = 0;
  int64_t bytes_in = 0, bytes_out = 0;
  double upload_seconds = 0, queue_seconds = 0, work_seconds = 0, total_seconds = 0;
  std::string road;
};

// Must be callable from many threads.
using JobLog = std::function<void(const JobRecord&)>;

// "job=7 status=OK points=100000 ...", without a line end. One line whatever `detail` holds.
std::string JobLine(const JobRecord& record);

}  // namespace rilievo
