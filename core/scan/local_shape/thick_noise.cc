#include "core/scan/local_shape/thick_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/points/belonging.h"
#include "core/scan/local_shape/quadric_residual.h"

namespace rilievo {
namespace {

constexpr int kLeastSamples = 32;
// Of the ball that a neighbourhood along the tangent plane is taken from.
constexpr int kBallPoints = 512;

// The points nearest to `center` along its tangent plane.
std::vector<int> AlongTangentPlane(const OrientedCloud& cloud, const PointIndex& index,
                                   int center) {
  std::array<int, kBallPoints> ball;
  std::array<double, kBallPoints> squared;
  const Eigen::Vector3d at = cloud.points.col(center), normal = cloud.normals.col(center);
  const int found =
      index.Nearest(at, std::min(kBallPoints, index.size()), ball.data(), squared.data());
  std::vector<std::pair<double, int>> along;
  for (int i = 0; i < found; ++i) {
    if (ball[i] == center || cloud.normals.col(ball[i]).dot(normal) < kSameSheet) continue;
    const double height = normal.dot(cloud.points.col(ball[i]) - at);
    along.emplace_back(squared[i] - height * height, ball[i]);
  }
  if (along.size() > kMostNeighbors) {
    std::nth_element(along.begin(), along.begin() + kMostNeighbors, along.end());
    along.resize(kMostNeighbors);
  }
  std::vector<int> points;
  for (const auto& [square, point] : along) points.push_back(point);
  return points;
}

double NoiseAlong(const OrientedCloud& cloud, const PointIndex& index, int center) {
  const std::vector<int> points = AlongTangentPlane(cloud, index, center);
  if (points.size() < kMostNeighbors / 2) return -1;
  double radius = 0;
  for (const int point : points) {
    radius = std::max(radius, (cloud.points.col(point) - cloud.points.col(center)).norm());
  }
  return QuadricResidual(cloud.points, center, points, radius, cloud.normals.col(center));
}

absl::StatusOr<double> FindScale(const OrientedCloud& cloud, const PointIndex& index,
                                 const RunContext& context) {
  const int64_t count = cloud.points.cols();
  const int64_t samples = std::min<int64_t>(count, kSampledPoints);
  std::vector<double> ratios(static_cast<size_t>(samples), -1);
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(samples, kHeavyBlock, context, [&](int64_t s) {
    const int point = static_cast<int>(s * count / samples);
    const double noise = cloud.noise[point], spacing = cloud.spacing[point];
    if (!(noise > kUnderstatedNoise * spacing)) return;
    const double found = NoiseAlong(cloud, index, point);
    if (found >= 0) ratios[s] = found / noise;
  }));
  ratios.erase(std::remove(ratios.begin(), ratios.end(), -1.0), ratios.end());
  if (ratios.size() < kLeastSamples) return 1.0;
  return std::max(Median(std::move(ratios)), 1.0);
}

}  // namespace

absl::Status CorrectThickNoise(const PointIndex& index, const RunContext& context,
                               OrientedCloud* cloud) {
  if (IsLeftOut(Mechanism::kThickNoise)) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(const double scale, FindScale(*cloud, index, context));
  if (scale == 1) return absl::OkStatus();
  for (size_t i = 0; i < cloud->noise.size(); ++i) {
    if (cloud->noise[i] > kUnderstatedNoise * cloud->spacing[i]) {
      cloud->noise[i] *= static_cast<float>(scale);
    }
  }
  cloud->median_noise = Median(cloud->noise);
  return absl::OkStatus();
}

}  // namespace rilievo
