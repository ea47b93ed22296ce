#include "server/rpc/job_error.h"

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/paging/scratch_file.h"
#include "server/conversion/memory_estimate.h"
#include "server/conversion/parts_request.h"

namespace rilievo {

CallError ShutdownError() {
  return CallError(ErrorCause::kShuttingDown,
                   "the server is shutting down; try again later or at another one")
      .RetryAfter(std::chrono::seconds(5));
}

CallError StopError(StopReason reason, const ServerOptions& options) {
  const double job_seconds = static_cast<double>(options.max_job_time.count()) / 1000;
  const double idle_seconds = static_cast<double>(options.max_idle_time.count()) / 1000;
  switch (reason) {
    case StopReason::kJobTime:
      return CallError(ErrorCause::kJobTimeLimit,
                       absl::StrCat("the work took longer than the ", job_seconds,
                                    " s this server allows; ask for a lower max_level or fewer "
                                    "control_faces, or send fewer points"))
          .Limit(job_seconds);
    case StopReason::kIdle:
      return CallError(ErrorCause::kIdleLimit,
                       absl::StrCat("no message passed for ", idle_seconds,
                                    " s; send the points and half-close without long pauses"))
          .Limit(idle_seconds);
    case StopReason::kUploadTime:
      return CallError(ErrorCause::kUploadTimeLimit,
                       absl::StrCat("the points took longer to arrive than the ", job_seconds,
                                    " s this server allows; send fewer points"))
          .Limit(job_seconds);
    case StopReason::kShutdown:
      return ShutdownError();
    default:
      return {ErrorCause::kClientCancelled, "the client cancelled"};
  }
}

std::optional<CallError> FitIntoMemory(const ServerOptions& options, JobRequest* job) {
  const int64_t needed = EstimateMemory(*job), limit = options.MemoryOfJob();
  if (needed <= limit) return std::nullopt;
  const auto megabytes = [](int64_t bytes) { return absl::StrCat(bytes / 1'000'000, " MB"); };
  const int64_t of_parts =
      EstimateMemoryOfParts(PartSizes::Of(options.part_points), job->size.points);
  std::string parts;
  if (options.scratch.empty()) {
    parts = "with --scratch its operator can have such scans made by parts";
  } else if (std::string reason = ReasonAgainstParts(*job); !reason.empty()) {
    parts = std::move(reason);
  } else if (of_parts > limit) {
    parts = absl::StrCat("by parts it would need ", megabytes(of_parts),
                         "; its operator can lower --part-points");
  } else {
    job->parts = PartsRequest{options.part_points, ScratchFolder(options.scratch)};
    return std::nullopt;
  }
  return CallError(ErrorCause::kMemoryLimit,
                   absl::StrCat("the job would need about ", megabytes(needed),
                                " of memory, one job may take ", megabytes(limit),
                                "; send fewer points or ask for a lower max_level (", parts, ")"))
      .Limit(limit, needed);
}

std::optional<CallError> CheckScratch(const JobRequest& job) {
  if (!job.parts) return std::nullopt;
  const int64_t needed = EstimateScratch(job) + job.size.bytes();
  if (CheckRoom(job.parts->scratch, needed).ok()) return std::nullopt;
  return CallError(ErrorCause::kStoreFull,
                   "the server has no room on its disk for the parts of so large a scan; try again "
                   "later, or send fewer points")
      .RetryAfter(std::chrono::seconds(30));
}

std::string FieldAtFault(Stage stage, const JobRequest& job, const absl::Status& status) {
  if (job.size.triangles > 0 && absl::StartsWith(status.message(), "triangles")) return "triangles";
  if (job.size.base_bytes > 0) {
    return absl::StartsWith(status.message(), "the scan") ? "points" : "base";
  }
  const bool own_mesh = job.options.control.user_mesh.has_value();
  if (stage == Stage::kDomainFit && own_mesh) return "header.options.control.control_mesh";
  if (stage != Stage::kControlMesh) return "points";
  return own_mesh ? "header.options.control.control_mesh" : "header.options.control";
}

}  // namespace rilievo
