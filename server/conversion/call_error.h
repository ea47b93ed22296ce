// Errors as clients see them.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace rilievo {

struct FieldViolation {
  std::string field;        // path within the request, e.g. "header.options.fit.rounds"
  std::string description;  // the value found, what is allowed, what to do
};

// Holds nothing of this machine: no path, no host, no stack.
struct CallError {
  absl::StatusCode code = absl::StatusCode::kInternal;
  std::string message = {};                     // whole sentences for people
  std::string reason = {};                      // of ErrorInfo, e.g. "JOBS_LIMIT"; may be empty
  std::vector<FieldViolation> violations = {};  // of BadRequest
  std::optional<std::chrono::milliseconds> retry_delay = {};
};

// INVALID_ARGUMENT whose message repeats the violations (at least one).
CallError BadRequestError(std::vector<FieldViolation> violations);

// What a failed stage tells the client. `field`: what of the request the failure is about. Codes
// that are no fault of the request become INTERNAL, and their text stays with the operator;
// ABORTED, a worker killed from outside, becomes RESOURCE_EXHAUSTED with a time to retry;
// UNAVAILABLE is trouble of this machine, DATA_LOSS a stored scan that is not what it was.
CallError ErrorOfJob(const absl::Status& status, const std::string& field, uint64_t job);

}  // namespace rilievo
