// From the error of a call to absl::Status, nothing of its details lost.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"

namespace google::rpc {
class Status;
}
namespace grpc {
class Status;
}

namespace rilievo {

// Same code. Message: the server's, then "field: description" for each field violation that it
// does not hold already. The google.rpc.Status is kept as a payload for the two functions below.
absl::Status StatusFromGrpc(const grpc::Status& status);

// The same for an error that travels in a message, such as that of a failed job.
absl::Status StatusFromRpc(const google::rpc::Status& status);

// A field of the request at fault.
struct ViolatedField {
  std::string field;        // path within the request, e.g. "header.options.fit.rounds"
  std::string description;  // the value found, what is allowed, what to do
};
std::vector<ViolatedField> ViolatedFields(const absl::Status& status);

// When the server asked for a retry: after how long.
std::optional<std::chrono::milliseconds> RetryDelay(const absl::Status& status);

// ErrorInfo.reason of a rilievod, such as "JOBS_LIMIT"; empty when the error is not from one.
std::string ErrorReason(const absl::Status& status);

}  // namespace rilievo
