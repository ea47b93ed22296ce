#include "core/pipeline/pages_to_thin.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>

#include "core/base/status_macros.h"
#include "core/paging/scratch_blocks.h"
#include "core/pipeline/analyze_block.h"
#include "core/pipeline/settings.h"
#include "core/scan/clean/check_scan.h"

namespace rilievo {
namespace {

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

// The points that a part of the step looks at: those of pages [begin, end).
struct LookedAt {
  LookedAt(const PagedScan& pages, int part, int parts) {
    const auto count = static_cast<int64_t>(pages.pages().size());
    begin = count * part / parts;
    end = count * (part + 1) / parts;
    points = std::min(pages.size(), end * kPagePoints) - begin * kPagePoints;
  }
  size_t bytes() const { return static_cast<size_t>((points + 7) / 8); }

  int64_t begin = 0, end = 0;
  int64_t points = 0;
};

// Bit i % 8 of byte i / 8 is set where point i of the run is an outlier or of foliage; none where
// the points are too few to tell.
absl::StatusOr<std::vector<uint8_t>> LeftOutOfRun(Eigen::Matrix3Xd run, const SpatialFrame& curve,
                                                  const CheckOptions& check,
                                                  const ScanOptions& of_run,
                                                  const RunContext& context) {
  const auto columns = static_cast<size_t>(run.cols());
  std::vector<uint8_t> left_out((columns + 7) / 8);
  PointCloud cloud;
  cloud.points = std::move(run);
  absl::StatusOr<CheckedScan> checked = CheckScan(cloud, check, context, curve);
  if (absl::IsInvalidArgument(checked.status())) return left_out;
  RILIEVO_RETURN_IF_ERROR(checked.status());
  const std::vector<int> source = std::move(checked->source_index);
  RILIEVO_ASSIGN_OR_RETURN(ScanNeighbors found,
                           FindNeighbors(*std::move(checked), of_run, context));
  const absl::StatusOr<std::vector<uint8_t>> keep = FindKept(std::move(found), of_run, context);
  if (absl::IsInvalidArgument(keep.status())) return left_out;
  RILIEVO_RETURN_IF_ERROR(keep.status());
  // Strays of the run, which the check has dropped, are outliers too.
  std::vector<bool> kept(columns, false);
  for (size_t i = 0; i < source.size(); ++i) kept[source[i]] = keep->empty() || (*keep)[i] != 0;
  for (size_t i = 0; i < columns; ++i) left_out[i / 8] |= kept[i] ? 0 : 1 << (i % 8);
  return left_out;
}

}  // namespace

absl::StatusOr<std::vector<bool>> LeftOutOfPages(const PagedScan& pages,
                                                 const ReconstructOptions& options,
                                                 const PartsRun& run, const RunContext& context) {
  const auto count = static_cast<int64_t>(pages.pages().size());
  const auto runs =
      static_cast<int>((count + kPagesToThin.pages_of_run - 1) / kPagesToThin.pages_of_run);
  ScanOptions of_run = options.scan;
  // A run may cut a small piece off a large one.
  if (runs > 1) of_run.outliers.min_component_share = 0;
  RILIEVO_ASSIGN_OR_RETURN(ScratchBlocks blocks,
                           ScratchBlocks::Create(pages.scratch_folder(), "left-out", runs,
                                                 kPagesToThin.pages_of_run * kPagePoints / 8));
  // A run does not get smaller with the parts that are asked for: two at once would not fit.
  PartsOfStep parts{.step = PartStep::kLeftOut, .count = runs, .at_once = 1};
  parts.is_there = [&](int part) {
    const absl::StatusOr<std::vector<uint8_t>> bytes = blocks.Read(part);
    return bytes.ok() && bytes->size() == LookedAt(pages, part, runs).bytes();
  };
  parts.make = [&](int part, const RunContext& own) -> absl::StatusOr<std::vector<uint8_t>> {
    const LookedAt at(pages, part, runs);
    RILIEVO_ASSIGN_OR_RETURN(Eigen::Matrix3Xd points, ReadPages(pages, at.begin, at.end, own));
    return LeftOutOfRun(std::move(points), pages.curve(), options.check, of_run, own);
  };
  parts.take = [&](int part, std::span<const uint8_t> bytes) -> absl::Status {
    if (bytes.size() != LookedAt(pages, part, runs).bytes()) {
      return NotOfPart(PartStep::kLeftOut, part);
    }
    return blocks.Write(part, bytes);
  };
  RILIEVO_RETURN_IF_ERROR(RunParts(parts, run, context));
  std::vector<bool> is_left_out(static_cast<size_t>(pages.size()), false);
  for (int part = 0; part < runs; ++part) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const LookedAt at(pages, part, runs);
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, blocks.Read(part));
    const auto first = static_cast<size_t>(at.begin * kPagePoints);
    for (size_t i = 0; i < static_cast<size_t>(at.points); ++i) {
      is_left_out[first + i] = (bytes[i / 8] >> (i % 8) & 1) != 0;
    }
  }
  return is_left_out;
}

absl::StatusOr<PointMedians> MediansOfPages(const PagedScan& pages, const ScanSurface& coarse,
                                            const ReconstructOptions& options,
                                            const RunContext& context) {
  const auto count = static_cast<int64_t>(pages.pages().size());
  Eigen::Matrix3Xd sample;
  if (count <= kPagesToThin.pages_of_run) {
    RILIEVO_ASSIGN_OR_RETURN(sample, ReadPages(pages, 0, count, context));
  } else {
    const int64_t pages_of_sampled = kPagesToThin.pages_of_run / kPagesToThin.sampled_runs;
    sample.resize(3, kPagesToThin.pages_of_run * kPagePoints);
    for (int64_t run = 0; run < kPagesToThin.sampled_runs; ++run) {
      // The last page of all may not be full.
      const int64_t begin = (count - 1 - pages_of_sampled) * run / (kPagesToThin.sampled_runs - 1);
      RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points,
                               ReadPages(pages, begin, begin + pages_of_sampled, context));
      sample.middleCols(run * points.cols(), points.cols()) = points;
    }
  }
  for (auto point : sample.colwise()) point = coarse.frame.UnitFromScan(point);
  RILIEVO_ASSIGN_OR_RETURN(const AnalyzedBlock block,
                           AnalyzeBlock(sample, pages.size(), Between(pages.curve(), coarse.frame),
                                        coarse, options, context));
  const OrientedCloud& cloud = block.cloud.points.cols() > 0 ? block.cloud : coarse.cloud;
  return PointMedians{cloud.median_spacing, cloud.median_noise};
}

}  // namespace rilievo
