// Errors as clients see them.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "google/rpc/status.pb.h"
#include "server/conversion/error_cause.h"

namespace rilievo {

struct FieldViolation {
  std::string field;        // path within the request, e.g. "header.options.fit.rounds"
  std::string description;  // the value found, what is allowed, what to do
};

// Holds nothing of this machine: no path, no host, no stack. The reason gives the status code.
struct CallError {
  CallError(ErrorCause why, std::string text) : reason(why), message(std::move(text)) {}

  absl::StatusCode code() const { return CodeOf(reason); }

  // What was allowed and what was found, in the unit that docs/api.md states for the reason.
  CallError& Limit(const absl::AlphaNum& limit, const absl::AlphaNum& value) {
    metadata["value"] = std::string(value.Piece());
    return Limit(limit);
  }
  CallError& Limit(const absl::AlphaNum& limit) {
    metadata["limit"] = std::string(limit.Piece());
    return *this;
  }
  CallError& RetryAfter(std::chrono::milliseconds delay) {
    retry_delay = delay;
    return *this;
  }

  ErrorCause reason;
  std::string message;                                     // whole sentences for people
  std::map<std::string, std::string> metadata = {};        // of ErrorInfo
  std::vector<FieldViolation> violations = {};             // of BadRequest
  std::optional<std::chrono::milliseconds> retry_delay{};  // of RetryInfo
};

// The message and the details, of which ErrorInfo is one; long lists and texts are cut.
google::rpc::Status RpcStatus(const CallError& error);

// INVALID_ARGUMENT whose message repeats the violations (at least one).
CallError BadRequestError(std::vector<FieldViolation> violations,
                          ErrorCause reason = ErrorCause::kInvalidField);

// For functions that know why a call fails, below those that answer it: StatedError() gives the
// error back without its violations and its delay; nothing when `status` is of another origin.
absl::Status StatusOf(const CallError& error);
std::optional<CallError> StatedError(const absl::Status& status);

// What a failed stage tells the client. `field`: what of the request the failure is about. Codes
// that are not the fault of the request become INTERNAL, and their text stays with the operator;
// ABORTED, a worker killed from outside, becomes RESOURCE_EXHAUSTED with a time to retry;
// UNAVAILABLE is trouble of this machine, DATA_LOSS a stored scan that is not what it was.
// `subject`: the caller's own name for what failed, such as "job 0f3a" by the id of a kept job; the
// text of INTERNAL repeats it for the operator. May be empty.
CallError ErrorOfJob(const absl::Status& status, const std::string& field,
                     const std::string& subject);

}  // namespace rilievo
