#include "core/pipeline/analyze_pages.h"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/saved_value.h"
#include "core/pipeline/analyze_block.h"
#include "core/pipeline/page_runs.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

using Box = Eigen::AlignedBox3d;

Surfel SurfelOf(const OrientedCloud& cloud, Eigen::Index i) {
  const Eigen::Vector3f normal = cloud.normals.col(i).cast<float>();
  return {{normal.x(), normal.y(), normal.z()}, cloud.spacing[i], cloud.noise[i]};
}

// The points of a run and its halo, in order; unit frame.
struct RunPoints {
  Eigen::Matrix3Xd points;
  Eigen::Index first = 0;  // column of the first of the run itself
};

absl::StatusOr<RunPoints> ReadRun(const PagedScan& scan, const PageRuns& runs, const PageRun& run,
                                  const SpatialFrame& frame, const RunContext& context) {
  std::vector<Eigen::Vector3d> within;
  RunPoints found;
  for (const int page : run.read) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    if (page == run.begin) found.first = static_cast<Eigen::Index>(within.size());
    const bool own = page >= run.begin && page < run.end;
    RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, scan.Read(page));
    for (const auto point : points.colwise()) {
      if (own || runs.IsAround(run, point)) within.push_back(frame.UnitFromScan(point));
    }
  }
  found.points = Eigen::Map<const Eigen::Matrix3Xd>(within.front().data(), 3,
                                                    static_cast<Eigen::Index>(within.size()));
  return found;
}

// Of points too few to be analyzed: those of the surface lie where thinned points of it are near.
absl::StatusOr<std::vector<Surfel>> SurfelsFromThinned(const Eigen::Matrix3Xd& points,
                                                       const ScanSurface& coarse,
                                                       const RunContext& context) {
  const OrientedCloud& cloud = coarse.cloud;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> nearest,
                           coarse.index.NearestOfEach(points, context));
  std::vector<Surfel> surfels(nearest.size());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const int near = nearest[i];
    const double away = (points.col(i) - cloud.points.col(near)).norm();
    if (away <= kAnalyzePages.near_spacings * cloud.spacing[near])
      surfels[i] = SurfelOf(cloud, near);
  }
  return surfels;
}

// By column of `points`, which are those of a run and its halo.
absl::StatusOr<std::vector<Surfel>> SurfelsOf(const Eigen::Matrix3Xd& points,
                                              int64_t points_of_scan, const SpatialFrame& curve,
                                              const ScanSurface& coarse,
                                              const ReconstructOptions& options,
                                              const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const AnalyzedBlock block,
                           AnalyzeBlock(points, points_of_scan, curve, coarse, options, context));
  if (block.cloud.points.cols() == 0) return SurfelsFromThinned(points, coarse, context);
  std::vector<Surfel> surfels(static_cast<size_t>(points.cols()));
  for (size_t i = 0; i < block.source.size(); ++i) {
    surfels[block.source[i]] = SurfelOf(block.cloud, static_cast<Eigen::Index>(i));
  }
  return surfels;
}

double MiddleOf(std::vector<float> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

absl::StatusOr<int64_t> PointsOfSurface(const PagedScan& scan, const ScratchSurfels& surfels,
                                        const RunContext& context) {
  int64_t count = 0;
  for (int page = 0; page < static_cast<int>(scan.pages().size()); ++page) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<Surfel> of_page, surfels.Read(page));
    count += std::count_if(of_page.begin(), of_page.end(),
                           [](const Surfel& surfel) { return surfel.is_of_surface(); });
  }
  return count;
}

}  // namespace

absl::StatusOr<AnalyzedPages> AnalyzePages(const PagedScan& scan, const ScanSurface& coarse,
                                           int64_t part_points, const ReconstructOptions& options,
                                           const PartsRun& run, const RunContext& context) {
  const double halo = kPageRuns.part_halo * coarse.cloud.median_spacing * coarse.frame.diagonal;
  const PageRuns cutter(scan, halo);
  const std::vector<PageRun> runs = cutter.Cut(part_points);
  RILIEVO_ASSIGN_OR_RETURN(ScratchSurfels surfels, ScratchSurfels::Create(scan));
  PartsOfStep parts{.step = PartStep::kSurfels, .count = static_cast<int>(runs.size())};
  parts.is_there = [&](int part) {
    for (int page = runs[part].begin; page < runs[part].end; ++page) {
      if (!surfels.Has(page)) return false;
    }
    return true;
  };
  parts.make = [&](int part, const RunContext& own) -> absl::StatusOr<std::vector<uint8_t>> {
    RILIEVO_ASSIGN_OR_RETURN(RunPoints read, ReadRun(scan, cutter, runs[part], coarse.frame, own));
    RILIEVO_ASSIGN_OR_RETURN(std::vector<Surfel> found,
                             SurfelsOf(read.points, scan.size(),
                                       Between(scan.curve(), coarse.frame), coarse, options, own));
    found.erase(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(read.first));
    found.resize(static_cast<size_t>(PointsOfRun(runs[part], scan.size())));
    ValueWriter writer;
    writer(found);
    return std::move(writer.bytes);
  };
  parts.take = [&](int part, std::span<const uint8_t> bytes) -> absl::Status {
    std::vector<Surfel> of_run;
    ValueReader reader(bytes);
    reader(of_run);
    const PageRun& pages = runs[part];
    if (!reader.Finished() ||
        static_cast<int64_t>(of_run.size()) != PointsOfRun(pages, scan.size()) ||
        !std::all_of(of_run.begin(), of_run.end(), IsPossible)) {
      return NotOfPart(PartStep::kSurfels, part);
    }
    auto next = of_run.begin();
    for (int page = pages.begin; page < pages.end; ++page) {
      const auto begin = next;
      next += static_cast<std::ptrdiff_t>(PointsOfPage(page, scan.size()));
      RILIEVO_RETURN_IF_ERROR(surfels.Write(page, std::vector<Surfel>(begin, next)));
    }
    ReleaseToOsAfter(scan.size());
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(RunParts(parts, run, context));
  RILIEVO_ASSIGN_OR_RETURN(const int64_t count, PointsOfSurface(scan, surfels, context));
  return AnalyzedPages{std::move(surfels), count};
}

absl::StatusOr<OrientedCloud> CloudIn(const Eigen::AlignedBox3d& box, const KnownPoints& known,
                                      const RunContext& context) {
  const PagedScan& scan = known.scan;
  const SpatialFrame& frame = known.frame;
  const Box in_scan(frame.ScanFromUnit(box.min()), frame.ScanFromUnit(box.max()));
  int64_t most = 0;
  for (const Page& page : scan.pages()) most += page.PointsNear(in_scan);
  OrientedCloud cloud;
  cloud.points.resize(3, most);
  cloud.normals.resize(3, most);
  cloud.spacing.reserve(static_cast<size_t>(most));
  cloud.noise.reserve(static_cast<size_t>(most));
  for (int page = 0; page < static_cast<int>(scan.pages().size()); ++page) {
    if (scan.pages()[page].PointsNear(in_scan) == 0) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, scan.Read(page));
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<Surfel> of_page, known.surfels.Read(page));
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Surfel& surfel = of_page[i];
      if (!surfel.is_of_surface() || !in_scan.contains(points.col(i))) continue;
      const auto column = static_cast<Eigen::Index>(cloud.spacing.size());
      cloud.points.col(column) = frame.UnitFromScan(points.col(i));
      const auto& [x, y, z] = surfel.normal;
      cloud.normals.col(column) = Eigen::Vector3d(x, y, z).normalized();
      cloud.spacing.push_back(surfel.spacing);
      cloud.noise.push_back(surfel.noise);
    }
  }
  const auto columns = static_cast<Eigen::Index>(cloud.spacing.size());
  cloud.points.conservativeResize(3, columns);
  cloud.normals.conservativeResize(3, columns);
  cloud.median_spacing = MiddleOf(cloud.spacing);
  cloud.median_noise = MiddleOf(cloud.noise);
  return cloud;
}

}  // namespace rilievo
