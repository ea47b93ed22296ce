#include "core/registration/scan_sample.h"

#include <cstdint>
#include <utility>

#include "absl/strings/cord.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/points/morton_order.h"
#include "core/scan/scan_surface.h"

namespace rilievo {
namespace {

// By point, ascending, as a checked scan is sorted.
std::vector<uint64_t> CodesOf(const Eigen::Matrix3Xd& points) {
  std::vector<uint64_t> codes(static_cast<size_t>(points.cols()));
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    codes[i] =
        MortonCode(MortonCell(points(0, i)), MortonCell(points(1, i)), MortonCell(points(2, i)));
  }
  return codes;
}

// Of one cell: [begin, end) along the curve. Any of its points, as the code of the cell has it.
size_t ChooseOne(size_t begin, size_t end, uint64_t cell) {
  constexpr uint64_t kSpread = 0x9E3779B97F4A7C15u;  // Knuth's multiplicative hash, 64 bits
  return begin + (cell * kSpread >> 32) % (end - begin);
}

// The chosen points of the cells that share all but the last `shift` bits of their codes.
std::vector<int> ChosenOf(const std::vector<uint64_t>& codes, int shift) {
  std::vector<int> chosen;
  for (size_t begin = 0, end = 0; begin < codes.size(); begin = end) {
    const uint64_t cell = codes[begin] >> shift;
    while (end < codes.size() && codes[end] >> shift == cell) ++end;
    chosen.push_back(static_cast<int>(ChooseOne(begin, end, cell)));
  }
  return chosen;
}

CheckedScan Thin(CheckedScan scan, int most_points) {
  if (scan.points.cols() <= most_points) return scan;
  const std::vector<uint64_t> codes = CodesOf(scan.points);
  std::vector<int> chosen;
  for (int shift = 0; chosen.empty() || chosen.size() > static_cast<size_t>(most_points);
       shift += 3) {
    chosen = ChosenOf(codes, shift);
  }
  scan.points = Eigen::Matrix3Xd(scan.points(Eigen::all, chosen));
  scan.sights = SightsOf(scan.sights, chosen);
  scan.source_index.clear();
  return scan;
}

// In the frame of the scan; no index yet.
absl::StatusOr<OrientedCloud> SampleOne(const PointCloud& scan, int most_points,
                                        const RunContext& context, SpatialFrame* frame) {
  RILIEVO_ASSIGN_OR_RETURN(CheckedScan checked, CheckScan(scan, CheckOptions{}, context));
  RILIEVO_ASSIGN_OR_RETURN(ScanSurface surface, AnalyzeScan(Thin(std::move(checked), most_points),
                                                            ScanOptions{}, context));
  *frame = surface.frame;
  return std::move(surface.cloud);
}

SpatialFrame FrameOfAll(const std::vector<OrientedCloud>& clouds,
                        const std::vector<SpatialFrame>& frames) {
  Eigen::Vector3d low, high;
  for (size_t i = 0; i < clouds.size(); ++i) {
    const Eigen::Vector3d own_low =
        frames[i].ScanFromUnit(clouds[i].points.rowwise().minCoeff().eval());
    const Eigen::Vector3d own_high =
        frames[i].ScanFromUnit(clouds[i].points.rowwise().maxCoeff().eval());
    low = i == 0 ? own_low : low.cwiseMin(own_low).eval();
    high = i == 0 ? own_high : high.cwiseMax(own_high).eval();
  }
  return {low / 2 + high / 2, (high - low).stableNorm()};
}

}  // namespace

absl::StatusOr<SampledScans> SampleScans(std::span<const PointCloud> scans, int most_points,
                                         const RunContext& context) {
  std::vector<OrientedCloud> clouds;
  std::vector<SpatialFrame> frames(scans.size());
  for (size_t i = 0; i < scans.size(); ++i) {
    absl::StatusOr<OrientedCloud> cloud = SampleOne(scans[i], most_points, context, &frames[i]);
    if (!cloud.ok()) {
      absl::Status status = cloud.status();
      status.SetPayload(kScanPayload, absl::Cord(absl::StrCat(i)));
      return status;
    }
    clouds.push_back(*std::move(cloud));
  }
  SampledScans sampled{{}, FrameOfAll(clouds, frames)};
  for (size_t i = 0; i < clouds.size(); ++i) {
    OrientedCloud& cloud = clouds[i];
    const SpatialFrame between = Between(frames[i], sampled.frame);
    for (auto point : cloud.points.colwise()) point = between.ScanFromUnit(point);
    for (float& spacing : cloud.spacing) spacing *= static_cast<float>(between.diagonal);
    RILIEVO_ASSIGN_OR_RETURN(PointIndex index, PointIndex::Build(cloud.points, context));
    const Eigen::Vector3d center = cloud.points.rowwise().mean();
    sampled.samples.push_back({std::move(cloud.points), std::move(cloud.normals),
                               std::move(cloud.spacing), cloud.median_spacing * between.diagonal,
                               cloud.median_noise * between.diagonal, center, std::move(index)});
  }
  return sampled;
}

}  // namespace rilievo
