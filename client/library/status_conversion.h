// From the error of a call to absl::Status, nothing of its details lost.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "absl/status/status.h"

namespace grpc {
class Status;
}

namespace rilievo {

// Same code. Message: the server's, then "field: description" for each field violation that it
// does not hold already. The google.rpc.Status is kept as a payload for the two functions below.
absl::Status StatusFromGrpc(const grpc::Status& status);

// When the server asked for a retry: after how long.
std::optional<std::chrono::milliseconds> RetryDelay(const absl::Status& status);

// ErrorInfo.reason of a rilievod, such as "JOBS_LIMIT"; empty when the error is not from one.
std::string ErrorReason(const absl::Status& status);

}  // namespace rilievo
