#include "server/conversion/call_error.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace rilievo {

CallError BadRequestError(std::vector<FieldViolation> violations) {
  CallError error;
  error.code = absl::StatusCode::kInvalidArgument;
  for (const FieldViolation& violation : violations) {
    absl::StrAppend(&error.message, error.message.empty() ? "" : "; ", violation.field, ": ",
                    violation.description);
  }
  error.violations = std::move(violations);
  return error;
}

CallError ErrorOfJob(const absl::Status& status, const std::string& field, uint64_t job) {
  CallError error;
  error.message = std::string(status.message());
  switch (status.code()) {
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
      error.code = absl::StatusCode::kInvalidArgument;
      error.violations = {{field, error.message}};
      return error;
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kResourceExhausted:
    case absl::StatusCode::kUnimplemented:
      error.code = status.code();
      return error;
    case absl::StatusCode::kDeadlineExceeded:
      error.code = status.code();
      error.reason = "JOB_TIME_LIMIT";
      return error;
    case absl::StatusCode::kAborted:
      error.code = absl::StatusCode::kResourceExhausted;
      error.reason = "WORKER_KILLED";
      error.retry_delay = std::chrono::seconds(1);
      return error;
    case absl::StatusCode::kUnavailable:
      error.code = status.code();
      error.message =
          "this server cannot work on jobs at present, of which its operator finds the cause in "
          "the "
          "log; try again later";
      error.reason = "WORKER_UNAVAILABLE";
      error.retry_delay = std::chrono::seconds(5);
      return error;
    case absl::StatusCode::kDataLoss:
      error.code = status.code();
      error.message = "the stored scan is damaged or gone; upload it again";
      error.reason = "SCAN_DAMAGED";
      return error;
    default:
      error.code = absl::StatusCode::kInternal;
      error.message = absl::StrCat("the server failed at job ", job,
                                   "; its operator finds the cause in the log");
      return error;
  }
}

}  // namespace rilievo
