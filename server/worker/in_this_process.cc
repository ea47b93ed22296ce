#include <chrono>
#include <exception>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/job_report.h"
#include "server/worker/job_work.h"

namespace rilievo {
namespace {

absl::StatusOr<JobResult> BringUpToDate(const JobRequest& job, const ScanContents& contents,
                                        const RunContext& context) {
  const auto begin = std::chrono::steady_clock::now();
  UpdateOptions options = job.update;
  options.most_vertices = job.base_vertices;
  absl::StatusOr<SurfaceUpdate> update =
      UpdateSurface(contents.base, contents.scan, options, context);
  // What the client sent as a surface is not one, or is of a newer version.
  if (absl::IsDataLoss(update.status()) || absl::IsUnimplemented(update.status())) {
    return absl::InvalidArgumentError(update.status().message());
  }
  RILIEVO_RETURN_IF_ERROR(update.status());
  JobResult result;
  auto from = update->dss.begin();
  for (const int64_t bytes : update->chunk_bytes) {
    result.encoded.chunks.emplace_back(from, from + bytes);
    from += bytes;
  }
  result.report = ProtoReport(update->report, static_cast<int64_t>(update->dss.size()));
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
  result.report.set_total_seconds(seconds.count());
  return result;
}

absl::StatusOr<JobResult> RunHere(const ReconstructFunction& reconstruct, const JobRequest& job,
                                  ScanBytes points, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(ScanContents contents, std::move(points).Decode(job.size));
  if (job.size.base_bytes > 0) return BringUpToDate(job, contents, context);
  contents.scan.sights.stations = job.stations;
  absl::StatusOr<Reconstruction> result =
      reconstruct(std::move(contents.scan), job.options, context);
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
