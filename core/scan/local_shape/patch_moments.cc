#include "core/scan/local_shape/patch_moments.h"

#include <pcl/common/centroid.h>
#include <pcl/common/eigen.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

Vector6d OuterProduct(const Eigen::Vector3d& v) {
  Vector6d outer;
  outer << v.x() * v.x(), v.x() * v.y(), v.x() * v.z(), v.y() * v.y(), v.y() * v.z(), v.z() * v.z();
  return outer;
}

// The unit frame in float: 3e-8 of the diagonal, a hundredth of the finest spacing of a scan of
// 10^9 points. PCL's sums run in double.
pcl::PointCloud<pcl::PointXYZ> PclCloud(const Eigen::Matrix3Xd& points) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  cloud.reserve(static_cast<size_t>(points.cols()));
  for (int64_t i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3f p = points.col(i).cast<float>();
    cloud.push_back(pcl::PointXYZ(p.x(), p.y(), p.z()));
  }
  return cloud;
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

absl::StatusOr<std::vector<PatchMoments>> ComputePatchMoments(const Eigen::Matrix3Xd& points,
                                                              const NeighborGraph& graph,
                                                              const RunContext& context) {
  const pcl::PointCloud<pcl::PointXYZ> cloud = PclCloud(points);
  std::vector<PatchMoments> result(static_cast<size_t>(points.cols()));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(points.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
        pcl::Indices patch;
        Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
        Eigen::Vector4d mean = Eigen::Vector4d::Zero();
        for (int64_t i = begin; i < end; ++i) {
          const auto neighbors = graph.neighbors(static_cast<int>(i));
          patch.assign(1, static_cast<int>(i));
          patch.insert(patch.end(), neighbors.begin(), neighbors.end());
          pcl::computeMeanAndCovarianceMatrix(cloud, patch, covariance, mean);
          const pcl::PointXYZ& own = cloud[i];
          result[i].mean_offset =
              (mean.head<3>() - Eigen::Vector3d(own.x, own.y, own.z)).cast<float>();
          result[i].covariance << static_cast<float>(covariance(0, 0)),
              static_cast<float>(covariance(0, 1)), static_cast<float>(covariance(0, 2)),
              static_cast<float>(covariance(1, 1)), static_cast<float>(covariance(1, 2)),
              static_cast<float>(covariance(2, 2));
        }
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
