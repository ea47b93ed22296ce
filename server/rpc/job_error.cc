#include "server/rpc/job_error.h"

#include "absl/strings/str_cat.h"
#include "server/conversion/memory_estimate.h"

namespace rilievo {

CallError ShutdownError() {
  return {.code = absl::StatusCode::kUnavailable,
          .message = "the server is shutting down; try again later or at another one",
          .reason = "SHUTTING_DOWN",
          .retry_delay = std::chrono::seconds(5)};
}

CallError StopError(StopReason reason, const ServerOptions& options) {
  switch (reason) {
    case StopReason::kJobTime:
      return {.code = absl::StatusCode::kDeadlineExceeded,
              .message = absl::StrCat("the work took longer than the ",
                                      options.max_job_time.count() / 1000.0,
                                      " s this server allows; ask for a lower max_level or fewer "
                                      "control_faces, or send fewer points"),
              .reason = "JOB_TIME_LIMIT"};
    case StopReason::kIdle:
      return {
          .code = absl::StatusCode::kDeadlineExceeded,
          .message = absl::StrCat("no message passed for ", options.max_idle_time.count() / 1000.0,
                                  " s; send the points and half-close without long pauses"),
          .reason = "IDLE_LIMIT"};
    case StopReason::kUploadTime:
      return {.code = absl::StatusCode::kDeadlineExceeded,
              .message = absl::StrCat("the points took longer to arrive than the ",
                                      options.max_job_time.count() / 1000.0,
                                      " s this server allows; send fewer points"),
              .reason = "UPLOAD_TIME_LIMIT"};
    case StopReason::kShutdown:
      return ShutdownError();
    default:
      return {.code = absl::StatusCode::kCancelled, .message = "the client cancelled"};
  }
}

std::optional<CallError> CheckMemory(const JobRequest& job, const ServerOptions& options) {
  const int64_t needed = EstimateMemory(job), budget = options.MemoryBudget();
  if (needed <= budget) return std::nullopt;
  return CallError{.code = absl::StatusCode::kResourceExhausted,
                   .message = absl::StrCat("the job would need about ", needed / 1'000'000,
                                           " MB of the ", budget / 1'000'000,
                                           " MB of memory this server has; send fewer "
                                           "points or ask for a lower max_level"),
                   .reason = "MEMORY_LIMIT"};
}

std::string FieldAtFault(Stage stage, const JobRequest& job) {
  const bool own_mesh = job.options.control.user_mesh.has_value();
  if (stage == Stage::kDomainFit && own_mesh) return "header.options.control.control_mesh";
  if (stage != Stage::kControlMesh) return "points";
  return own_mesh ? "header.options.control.control_mesh" : "header.options.control";
}

}  // namespace rilievo
