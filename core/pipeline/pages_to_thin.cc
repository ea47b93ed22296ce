#include "core/pipeline/pages_to_thin.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/base/status_macros.h"
#include "core/pipeline/analyze_block.h"
#include "core/scan/clean/check_scan.h"

namespace rilievo {
namespace {

// Pages are read and analyzed so many at a time.
constexpr int64_t kPagesOfRun = 64;
// Those that the medians come of, where the scan has more.
constexpr int64_t kSampledRuns = 16, kPagesOfSampledRun = kPagesOfRun / kSampledRuns;

// Column = point of pages [begin, end), scan frame.
absl::StatusOr<Eigen::Matrix3Xd> ReadPages(const PagedScan& pages, int64_t begin, int64_t end,
                                           const RunContext& context) {
  Eigen::Matrix3Xd run(3, std::min(pages.size(), end * kPagePoints) - begin * kPagePoints);
  for (int64_t page = begin; page < end; ++page) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, pages.Read(static_cast<int>(page)));
    run.middleCols((page - begin) * kPagePoints, points.cols()) = points;
  }
  return run;
}

// The columns of the run that are outliers or foliage; none where the points are too few to tell.
absl::StatusOr<std::vector<int>> LeftOutOfRun(Eigen::Matrix3Xd run, const CheckOptions& check,
                                              const ScanOptions& of_run,
                                              const RunContext& context) {
  const auto columns = static_cast<int>(run.cols());
  PointCloud cloud;
  cloud.points = std::move(run);
  absl::StatusOr<CheckedScan> checked = CheckScan(cloud, check, context);
  if (absl::IsInvalidArgument(checked.status())) return std::vector<int>();
  RILIEVO_RETURN_IF_ERROR(checked.status());
  const std::vector<int> source = std::move(checked->source_index);
  RILIEVO_ASSIGN_OR_RETURN(ScanNeighbors found,
                           FindNeighbors(*std::move(checked), of_run, context));
  const absl::StatusOr<std::vector<uint8_t>> keep = FindKept(std::move(found), of_run, context);
  if (absl::IsInvalidArgument(keep.status())) return std::vector<int>();
  RILIEVO_RETURN_IF_ERROR(keep.status());
  // Strays of the run, which the check has dropped, are outliers too.
  std::vector<bool> kept(static_cast<size_t>(columns), false);
  for (size_t i = 0; i < source.size(); ++i) kept[source[i]] = keep->empty() || (*keep)[i] != 0;
  std::vector<int> left_out;
  for (int column = 0; column < columns; ++column) {
    if (!kept[column]) left_out.push_back(column);
  }
  return left_out;
}

}  // namespace

absl::StatusOr<std::vector<bool>> LeftOutOfPages(const PagedScan& pages,
                                                 const ReconstructOptions& options,
                                                 const RunContext& context) {
  const auto count = static_cast<int64_t>(pages.pages().size());
  const int64_t runs = (count + kPagesOfRun - 1) / kPagesOfRun;
  ScanOptions of_run = options.scan;
  // A run may cut a small piece off a large one.
  if (runs > 1) of_run.outliers.min_component_share = 0;
  RunContext silent = context;
  silent.progress = nullptr;
  std::vector<bool> is_left_out(static_cast<size_t>(pages.size()), false);
  for (int64_t run = 0; run < runs; ++run) {
    context.Report(Stage::kCheck, static_cast<double>(run) / static_cast<double>(runs));
    const int64_t begin = count * run / runs, end = count * (run + 1) / runs;
    RILIEVO_ASSIGN_OR_RETURN(Eigen::Matrix3Xd points, ReadPages(pages, begin, end, context));
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> columns,
                             LeftOutOfRun(std::move(points), options.check, of_run, silent));
    for (const int column : columns) {
      is_left_out[static_cast<size_t>(begin * kPagePoints + column)] = true;
    }
  }
  return is_left_out;
}

absl::StatusOr<PointMedians> MediansOfPages(const PagedScan& pages, const ScanSurface& coarse,
                                            const ReconstructOptions& options,
                                            const RunContext& context) {
  const auto count = static_cast<int64_t>(pages.pages().size());
  Eigen::Matrix3Xd sample;
  if (count <= kPagesOfRun) {
    RILIEVO_ASSIGN_OR_RETURN(sample, ReadPages(pages, 0, count, context));
  } else {
    sample.resize(3, kPagesOfRun * kPagePoints);
    for (int64_t run = 0; run < kSampledRuns; ++run) {
      // The last page of all may not be full.
      const int64_t begin = (count - 1 - kPagesOfSampledRun) * run / (kSampledRuns - 1);
      RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points,
                               ReadPages(pages, begin, begin + kPagesOfSampledRun, context));
      sample.middleCols(run * points.cols(), points.cols()) = points;
    }
  }
  for (auto point : sample.colwise()) point = coarse.frame.UnitFromScan(point);
  RILIEVO_ASSIGN_OR_RETURN(const AnalyzedBlock block,
                           AnalyzeBlock(sample, pages.size(), coarse, options, context));
  const OrientedCloud& cloud = block.cloud.points.cols() > 0 ? block.cloud : coarse.cloud;
  return PointMedians{cloud.median_spacing, cloud.median_noise};
}

}  // namespace rilievo
