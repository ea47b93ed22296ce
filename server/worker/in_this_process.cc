#include <exception>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/job_report.h"
#include "server/worker/job_work.h"

namespace rilievo {
namespace {

absl::StatusOr<JobResult> RunHere(const ReconstructFunction& reconstruct, const JobRequest& job,
                                  ScanBytes points, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(
      PointCloud scan, std::move(points).Decode(job.layout, job.point_count, job.triangle_count));
  scan.sights.stations = job.stations;
  absl::StatusOr<Reconstruction> result = reconstruct(std::move(scan), job.options, context);
  // DATA_LOSS is said of the points; what came of them is to decode.
  if (absl::IsDataLoss(result.status())) return absl::InternalError(result.status().message());
  RILIEVO_RETURN_IF_ERROR(result.status());
  return JobResult{std::move(result->encoded), ProtoReport(result->report, job.options.measure)};
}

}  // namespace

JobWork InThisProcess(ReconstructFunction reconstruct) {
  return [reconstruct = std::move(reconstruct)](
             const JobRequest& job, ScanBytes points,
             const RunContext& context) -> absl::StatusOr<JobResult> {
    try {
      return RunHere(reconstruct, job, std::move(points), context);
    } catch (const std::bad_alloc&) {
      return absl::ResourceExhaustedError("the memory of the server does not suffice");
    } catch (const std::exception& defect) {
      return absl::InternalError(absl::StrCat("a stage let an exception pass: ", defect.what()));
    }
  };
}

}  // namespace rilievo
