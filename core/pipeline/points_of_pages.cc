#include "core/pipeline/points_of_pages.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <span>

#include "core/base/status_macros.h"
#include "core/pipeline/certificate.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

absl::StatusOr<PointsOfPages> PointsOfPages::Create(const PagedScan& scan,
                                                    const ScratchSurfels& surfels,
                                                    const SpatialFrame& frame) {
  RILIEVO_ASSIGN_OR_RETURN(
      ScratchBlocks distances,
      ScratchBlocks::Create(scan.scratch_folder().WithoutNames(), "",
                            static_cast<int>(scan.pages().size()),
                            kPagePoints * static_cast<int64_t>(sizeof(float))));
  return PointsOfPages(scan, surfels, frame, std::move(distances));
}

Eigen::AlignedBox3d PointsOfPages::Box(int page) const {
  const Eigen::AlignedBox3d& box = scan_.pages()[page].box;
  return {frame_.UnitFromScan(box.min()), frame_.UnitFromScan(box.max())};
}

absl::StatusOr<Shape> PointsOfPages::Read(int page) const {
  RILIEVO_ASSIGN_OR_RETURN(const Eigen::Matrix3Xd points, scan_.Read(page));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<Surfel> surfels, surfels_.Read(page));
  OrientedCloud cloud;
  cloud.points.resize(3, points.cols());
  cloud.normals.resize(3, points.cols());
  Eigen::Index count = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Surfel& surfel = surfels[i];
    if (!surfel.is_of_surface()) continue;
    cloud.points.col(count) = frame_.UnitFromScan(points.col(i));
    for (int axis = 0; axis < 3; ++axis) cloud.normals(axis, count) = surfel.normal[axis];
    cloud.spacing.push_back(surfel.spacing);
    ++count;
  }
  cloud.points.conservativeResize(3, count);
  cloud.normals.conservativeResize(3, count);
  return PointsToMeasure(std::move(cloud));
}

absl::StatusOr<std::vector<float>> PointsOfPages::Distances(int page) const {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, distances_.Read(page));
  if (!bytes.empty()) {
    std::vector<float> squared(bytes.size() / sizeof(float));
    std::memcpy(squared.data(), bytes.data(), bytes.size());
    return squared;
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<Surfel> surfels, surfels_.Read(page));
  const auto count = std::count_if(surfels.begin(), surfels.end(),
                                   [](const Surfel& surfel) { return surfel.is_of_surface(); });
  return std::vector<float>(static_cast<size_t>(count), std::numeric_limits<float>::infinity());
}

absl::Status PointsOfPages::WriteDistances(int page, const std::vector<float>& squared) {
  return distances_.Write(page, std::span(reinterpret_cast<const uint8_t*>(squared.data()),
                                          squared.size() * sizeof(float)));
}

}  // namespace rilievo
