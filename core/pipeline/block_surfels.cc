#include "core/pipeline/block_surfels.h"

#include <algorithm>
#include <utility>

#include "core/base/status_macros.h"

namespace rilievo {
namespace {

Surfel SurfelOf(const OrientedCloud& cloud, Eigen::Index i, uint32_t known) {
  const Eigen::Vector3f normal = cloud.normals.col(i).cast<float>();
  return {{normal.x(), normal.y(), normal.z()}, cloud.spacing[i], known};
}

}  // namespace

OrientedCloud CloudInScanFrame(ScanSurface scan) {
  const SpatialFrame& frame = scan.frame;
  OrientedCloud cloud = std::move(scan.cloud);
  for (auto point : cloud.points.colwise()) point = frame.ScanFromUnit(point);
  const auto scale = static_cast<float>(frame.diagonal);
  for (float& spacing : cloud.spacing) spacing *= scale;
  for (float& noise : cloud.noise) noise *= scale;
  cloud.median_spacing *= frame.diagonal;
  cloud.median_noise *= frame.diagonal;
  return cloud;
}

absl::StatusOr<AnalyzedBlock> AnalyzeBlock(const Eigen::Matrix3Xd& points, int64_t points_of_scan,
                                           const ScanSurface& coarse,
                                           const ReconstructOptions& options,
                                           const RunContext& context) {
  PointCloud block;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> nearest,
                           coarse.index.NearestOfEach(points, context));
  block.points = points;
  block.sights.normals = coarse.cloud.normals(Eigen::all, nearest).cast<float>();
  ScanOptions of_block = options.scan;
  of_block.sights = {SightRule::kIgnore, SightRule::kUse};
  // Islands are as large as they would have to be in the whole.
  of_block.outliers.min_component_share =
      std::min(0.1, options.scan.outliers.min_component_share *
                        static_cast<double>(points_of_scan) / static_cast<double>(points.cols()));
  absl::StatusOr<CheckedScan> checked = CheckScan(block, options.check, context);
  block = PointCloud();
  AnalyzedBlock found;
  if (absl::IsInvalidArgument(checked.status())) return found;
  RILIEVO_RETURN_IF_ERROR(checked.status());
  found.source = std::move(checked->source_index);
  absl::StatusOr<ScanSurface> analyzed = AnalyzeScan(*std::move(checked), of_block, context);
  if (absl::IsInvalidArgument(analyzed.status())) return AnalyzedBlock();
  RILIEVO_RETURN_IF_ERROR(analyzed.status());
  size_t kept = 0;
  for (size_t i = 0; i < analyzed->keep.size(); ++i) {
    if (analyzed->keep[i] != 0) found.source[kept++] = found.source[i];
  }
  if (!analyzed->keep.empty()) found.source.resize(kept);
  found.cloud = CloudInScanFrame(*std::move(analyzed));
  return found;
}

std::vector<uint8_t> PointsToTellOf(const Eigen::Matrix3Xd& points, size_t part,
                                    const std::vector<Eigen::AlignedBox3d>& boxes) {
  const auto depth = [&](size_t of, const Eigen::Vector3d& point) {
    return std::min((point - boxes[of].min()).minCoeff(), (boxes[of].max() - point).minCoeff());
  };
  std::vector<size_t> others;
  for (size_t other = 0; other < boxes.size(); ++other) {
    if (other != part && boxes[other].intersects(boxes[part])) others.push_back(other);
  }
  std::vector<uint8_t> own(static_cast<size_t>(points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d point = points.col(i);
    const double here = depth(part, point);
    own[i] = std::none_of(others.begin(), others.end(), [&](size_t other) {
      const double there = depth(other, point);
      return there > here || (there == here && other < part);
    });
  }
  return own;
}

absl::StatusOr<uint64_t> WriteSurfels(const AnalyzedBlock& block, size_t part,
                                      const std::vector<uint8_t>& own,
                                      const std::vector<int64_t>& ranks, ScratchSurfels* surfels) {
  const auto known = static_cast<uint32_t>(part + 1);
  std::vector<int64_t> at(own.size());
  std::vector<Surfel> of_block(own.size(), Surfel{{}, 0, known});
  for (size_t i = 0; i < block.source.size(); ++i) {
    of_block[block.source[i]] = SurfelOf(block.cloud, static_cast<Eigen::Index>(i), known);
  }
  size_t count = 0;
  for (size_t i = 0; i < own.size(); ++i) {
    if (own[i] == 0) continue;
    at[count] = ranks[i];
    of_block[count++] = of_block[i];
  }
  at.resize(count);
  of_block.resize(count);
  return surfels->Write(at, of_block);
}

absl::StatusOr<int64_t> CompleteSurfels(const PagedScan& scan, const ScanSurface& coarse,
                                        const RunContext& context, ScratchSurfels* surfels) {
  constexpr double kNearSpacings = 3;
  const OrientedCloud& cloud = coarse.cloud;
  int64_t of_surface = 0;
  for (int page = 0; page < static_cast<int>(scan.pages().size()); ++page) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    RILIEVO_ASSIGN_OR_RETURN(std::vector<Surfel> of_page, surfels->Read(page));
    const auto is_unknown = [](const Surfel& surfel) { return surfel.known == 0; };
    if (std::any_of(of_page.begin(), of_page.end(), is_unknown)) {
      RILIEVO_ASSIGN_OR_RETURN(Eigen::Matrix3Xd points, scan.Read(page));
      for (auto point : points.colwise()) point = coarse.frame.UnitFromScan(point);
      RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> nearest,
                               coarse.index.NearestOfEach(points, context));
      for (Eigen::Index i = 0; i < points.cols(); ++i) {
        if (!is_unknown(of_page[i])) continue;
        const int near = nearest[i];
        const double away = (points.col(i) - cloud.points.col(near)).norm();
        of_page[i] = away <= kNearSpacings * cloud.spacing[near]
                         ? SurfelOf(cloud, near, Surfel::kFromThinned)
                         : Surfel{{}, 0, Surfel::kFromThinned};
      }
      RILIEVO_RETURN_IF_ERROR(surfels->WritePage(page, of_page));
    }
    of_surface += std::count_if(of_page.begin(), of_page.end(),
                                [](const Surfel& surfel) { return surfel.is_of_surface(); });
  }
  return of_surface;
}

}  // namespace rilievo
