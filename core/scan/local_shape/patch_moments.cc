#include "core/scan/local_shape/patch_moments.h"

#include <pcl/common/eigen.h>

#include <algorithm>

#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

Vector6d OuterProduct(const Eigen::Vector3d& v) {
  Vector6d outer;
  outer << v.x() * v.x(), v.x() * v.y(), v.x() * v.z(), v.y() * v.y(), v.y() * v.z(), v.z() * v.z();
  return outer;
}

}  // namespace

PatchPlane FitPlane(const PatchMoments& moments) {
  const Vector6d c = moments.covariance.cast<double>();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance << c[0], c[1], c[2], c[1], c[3], c[4], c[2], c[4], c[5];
  PatchPlane plane;
  Eigen::Vector3d normal;
  double smallest = 0;
  pcl::eigen33(covariance, smallest, normal);
  if (normal.allFinite() && normal.squaredNorm() > 0.5) plane.normal = normal.normalized();
  plane.thickness = std::max(0.0, smallest);
  plane.spread = std::max(0.0, (covariance.trace() - plane.thickness) / 2);
  return plane;
}

PatchMoments MomentsOf(const Eigen::Matrix3Xd& points, int center, std::span<const int> neighbors) {
  PatchSum sum;
  sum.Add(PatchMoments(), Eigen::Vector3d::Zero());
  for (const int j : neighbors) sum.Add(PatchMoments(), points.col(j) - points.col(center));
  return sum.Mean();
}

absl::StatusOr<std::vector<PatchMoments>> ComputePatchMoments(const Eigen::Matrix3Xd& points,
                                                              const NeighborGraph& graph,
                                                              const RunContext& context) {
  std::vector<PatchMoments> result(static_cast<size_t>(points.cols()));
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(points.cols(), kSearchBlock, context, [&](int64_t i) {
    const int center = static_cast<int>(i);
    result[i] = MomentsOf(points, center, graph.neighbors(center));
  }));
  return result;
}

void PatchSum::Add(const PatchMoments& patch, const Eigen::Vector3d& offset) {
  const Eigen::Vector3d mean = offset + patch.mean_offset.cast<double>();
  ++count_;
  first_ += mean;
  second_ += patch.covariance.cast<double>() + OuterProduct(mean);
}

PatchMoments PatchSum::Mean() const {
  const Eigen::Vector3d mean = first_ / count_;
  PatchMoments result;
  result.mean_offset = mean.cast<float>();
  result.covariance = (second_ / count_ - OuterProduct(mean)).cast<float>();
  return result;
}

}  // namespace rilievo
