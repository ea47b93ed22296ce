#include "core/scan/normals.h"

#include <pcl/common/centroid.h>
#include <pcl/common/eigen.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr int64_t kBlock = 1024;

pcl::PointCloud<pcl::PointXYZ> PclCloud(const Eigen::Matrix3Xd& points) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  cloud.reserve(static_cast<size_t>(points.cols()));
  for (const auto& point : points.colwise()) {
    const Eigen::Vector3f p = point.cast<float>();
    cloud.push_back(pcl::PointXYZ(p.x(), p.y(), p.z()));
  }
  return cloud;
}

// The mean over the outer half of the list: the share of the j-th neighbour's disc is
// pi d_j^2 / j = pi/4 spacing^2. Near neighbours on one scan line say little of the surface.
float LocalSpacing(std::span<const float> distances) {
  const size_t first = distances.size() / 2;
  double sum = 0;
  for (size_t j = first; j < distances.size(); ++j) {
    sum += 4.0 * distances[j] * distances[j] / static_cast<double>(j + 1);
  }
  return static_cast<float>(std::sqrt(sum / static_cast<double>(distances.size() - first)));
}

// RMS residual of the quadric height field over the plane of `normal`, per degree of freedom, so
// that curvature is not taken for noise and Gaussian noise is not underestimated.
double QuadricResidual(const Eigen::Matrix3Xd& points, int center, std::span<const int> neighbors,
                       double radius, const Eigen::Vector3d& normal) {
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  constexpr int kUnknowns = 6;
  if (!(radius > 0) || neighbors.size() < kUnknowns + 1) return 0;
  const Eigen::Vector3d u = normal.unitOrthogonal();
  const Eigen::Vector3d v = normal.cross(u);
  Matrix6 gram = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  double heights = 0;
  const auto add = [&](const Eigen::Vector3d& offset) {
    const double x = u.dot(offset), y = v.dot(offset), z = normal.dot(offset);
    Vector6 row;
    row << 1, x, y, x * x, x * y, y * y;
    gram.selfadjointView<Eigen::Lower>().rankUpdate(row);
    right += z * row;
    heights += z * z;
  };
  add(Eigen::Vector3d::Zero());
  for (const int j : neighbors) add((points.col(j) - points.col(center)) / radius);
  gram.diagonal().array() += 1e-9;  // neighbours on one line leave the quadric undetermined
  const Vector6 fit = gram.selfadjointView<Eigen::Lower>().ldlt().solve(right);
  const double squares = std::max(0.0, heights - fit.dot(right));
  return radius * std::sqrt(squares / (static_cast<double>(neighbors.size()) + 1 - kUnknowns));
}

double Median(std::vector<float> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<int64_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

absl::StatusOr<OrientedCloud> EstimateNormals(const Eigen::Matrix3Xd& points,
                                              const NeighborGraph& graph,
                                              const RunContext& context) {
  const int64_t count = points.cols();
  OrientedCloud cloud;
  cloud.points = points;
  cloud.normals.resize(3, count);
  cloud.spacing.resize(static_cast<size_t>(count));
  cloud.noise.resize(static_cast<size_t>(count));
  const pcl::PointCloud<pcl::PointXYZ> pcl_cloud = PclCloud(points);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
    pcl::Indices patch;
    for (int64_t i = begin; i < end; ++i) {
      const int center = static_cast<int>(i);
      const std::span<const int> neighbors = graph.neighbors(center);
      patch.assign(1, center);
      patch.insert(patch.end(), neighbors.begin(), neighbors.end());
      Eigen::Matrix3d covariance;
      Eigen::Vector4d centroid;
      pcl::computeMeanAndCovarianceMatrix(pcl_cloud, patch, covariance, centroid);
      double smallest = 0;
      Eigen::Vector3d normal;
      pcl::eigen33(covariance, smallest, normal);
      if (!normal.allFinite() || !(normal.squaredNorm() > 0.5)) normal = Eigen::Vector3d::UnitZ();
      cloud.normals.col(i) = normal.normalized();
      const std::span<const float> distances = graph.neighbor_distances(center);
      cloud.spacing[i] = LocalSpacing(distances);
      cloud.noise[i] = static_cast<float>(
          QuadricResidual(points, center, neighbors, distances.back(), cloud.normals.col(i)));
    }
  }));
  cloud.median_spacing = Median(cloud.spacing);
  cloud.median_noise = Median(cloud.noise);
  return cloud;
}

}  // namespace rilievo
