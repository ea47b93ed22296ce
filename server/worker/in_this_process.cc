#include <chrono>
#include <exception>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/paging/scan_pager.h"
#include "core/paging/scratch_file.h"
#include "server/conversion/job_report.h"
#include "server/conversion/parts_request.h"
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

// DATA_LOSS is said of the points: of files of this process's own it is a defect.
absl::Status OfOwnFiles(const absl::Status& status) {
  return absl::IsDataLoss(status) ? absl::InternalError(status.message()) : status;
}

absl::StatusOr<JobResult> MakeByParts(const JobRequest& job, ScanBytes points,
                                      const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(ScanPager pager, ScanPager::Create(job.parts->scratch));
  RILIEVO_RETURN_IF_ERROR(pager.Expect(job.size.points));
  const auto add = [&](const Eigen::Matrix3Xd& block) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    return pager.Add(block);
  };
  RILIEVO_RETURN_IF_ERROR(std::move(points).DecodeInBlocks(job.size, add));
  const absl::StatusOr<PagedScan> pages = std::move(pager).Finish(context);
  RILIEVO_RETURN_IF_ERROR(OfOwnFiles(pages.status()));
  const PartSizes sizes = PartSizes::Of(job.parts->points);
  SharedParts* const shared = job.parts->shared.get();
  if (shared != nullptr && !shared->leads()) {
    RILIEVO_RETURN_IF_ERROR(OfOwnFiles(HelpWithParts(*pages, sizes, job.options, context, shared)));
    return JobResult{};
  }
  absl::StatusOr<Reconstruction> made =
      ReconstructPaged(*pages, sizes, job.options, context, shared);
  RILIEVO_RETURN_IF_ERROR(OfOwnFiles(made.status()));
  JobResult result{std::move(made->encoded), ProtoReport(made->report, job.options.measure)};
  const std::string warning = PlacesAloneWarning(job);
  if (!warning.empty()) result.report.add_warnings(warning);
  return result;
}

absl::StatusOr<JobResult> RunHere(const ReconstructFunction& reconstruct, const JobRequest& job,
                                  ScanBytes points, const RunContext& context) {
  if (job.parts) return MakeByParts(job, std::move(points), context);
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

JobWork InServerProcess(ReconstructFunction reconstruct) {
  return [work = InThisProcess(std::move(reconstruct))](
             const JobRequest& job, ScanBytes points,
             const RunContext& context) -> absl::StatusOr<JobResult> {
    absl::StatusOr<JobResult> result = work(job, std::move(points), context);
    if (!IsOfScratchFolder(result.status())) return result;
    return absl::UnavailableError(result.status().message());
  };
}

}  // namespace rilievo
