#include "core/scan/local_shape/thick_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/points/belonging.h"
#include "core/scan/local_shape/quadric_residual.h"

namespace rilievo {
namespace {

constexpr int kMostSamples = 384;
constexpr int kLeastSamples = 32;
constexpr double kMostScale = 4;
// Below the middle: edges and bumps within a neighbourhood only ever add to the residual.
constexpr double kQuantile = 0.4;
// Of a neighbourhood along the tangent plane, and of the ball that it is taken from.
constexpr int kFitPoints = 60;
constexpr int kMostBallPoints = 4096;
constexpr double kBallGrowth = 200;
// Balls for the noise that the one before has shown, while it grows.
constexpr int kLooks = 3;
// Points of another sheet: they face away.
constexpr double kLeastAgreement = 0.2;

// How many points there are to be in it where noise is so many spacings thick.
int BallFor(double ratio) {
  return static_cast<int>(
      std::min(kFitPoints + kBallGrowth * ratio * ratio, double{kMostBallPoints}));
}

// The points nearest to `center` along its tangent plane.
std::vector<int> AlongTangentPlane(const OrientedCloud& cloud, const PointIndex& index, int center,
                                   int wanted) {
  std::array<int, kMostBallPoints> ball;
  std::array<double, kMostBallPoints> squared;
  const Eigen::Vector3d at = cloud.points.col(center), normal = cloud.normals.col(center);
  const int found = index.Nearest(at, std::min(wanted, index.size()), ball.data(), squared.data());
  std::vector<std::pair<double, int>> along;
  for (int i = 0; i < found; ++i) {
    if (ball[i] == center || cloud.normals.col(ball[i]).dot(normal) < kLeastAgreement) continue;
    const double height = normal.dot(cloud.points.col(ball[i]) - at);
    along.emplace_back(squared[i] - height * height, ball[i]);
  }
  if (along.size() > kFitPoints) {
    std::nth_element(along.begin(), along.begin() + kFitPoints, along.end());
    along.resize(kFitPoints);
  }
  std::vector<int> points;
  for (const auto& [square, point] : along) points.push_back(point);
  return points;
}

double NoiseAlong(const OrientedCloud& cloud, const PointIndex& index, int center, int ball) {
  const std::vector<int> points = AlongTangentPlane(cloud, index, center, ball);
  if (points.size() < kFitPoints / 2) return -1;
  double radius = 0;
  for (const int point : points) {
    radius = std::max(radius, (cloud.points.col(point) - cloud.points.col(center)).norm());
  }
  return QuadricResidual(cloud.points, center, points, radius, cloud.normals.col(center));
}

absl::StatusOr<double> FindScale(const OrientedCloud& cloud, const PointIndex& index,
                                 const RunContext& context) {
  const int64_t count = cloud.points.cols();
  const int64_t samples = std::min<int64_t>(count, kMostSamples);
  std::vector<double> ratios(static_cast<size_t>(samples), -1);
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(samples, kHeavyBlock, context, [&](int64_t s) {
    const int point = static_cast<int>(s * count / samples);
    const double noise = cloud.noise[point], spacing = cloud.spacing[point];
    if (!(noise > kUnderstatedNoise * spacing)) return;
    double ratio = noise / spacing;
    for (int look = 0; look < kLooks; ++look) {
      const double found = NoiseAlong(cloud, index, point, BallFor(ratio));
      if (found < 0) return;
      ratios[s] = found / noise;
      if (found <= ratio * spacing) return;
      ratio = found / spacing;
    }
  }));
  ratios.erase(std::remove(ratios.begin(), ratios.end(), -1.0), ratios.end());
  if (ratios.size() < kLeastSamples) return 1.0;
  const auto middle =
      ratios.begin() + static_cast<int64_t>(kQuantile * static_cast<double>(ratios.size()));
  std::nth_element(ratios.begin(), middle, ratios.end());
  return std::clamp(*middle, 1.0, kMostScale);
}

}  // namespace

absl::Status CorrectThickNoise(const PointIndex& index, const RunContext& context,
                               OrientedCloud* cloud) {
  if (IsLeftOut(Mechanism::kThickNoise)) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(const double scale, FindScale(*cloud, index, context));
  if (scale == 1) return absl::OkStatus();
  for (size_t i = 0; i < cloud->noise.size(); ++i) {
    const double ratio = cloud->noise[i] / std::max(double{cloud->spacing[i]}, 1e-30);
    const double share =
        std::clamp((ratio - kUnderstatedNoise) / (kThickNoiseRatio - kUnderstatedNoise), 0.0, 1.0);
    cloud->noise[i] *= static_cast<float>(1 + share * (scale - 1));
  }
  std::vector<float> noise = cloud->noise;
  const auto middle = noise.begin() + static_cast<int64_t>((noise.size() - 1) / 2);
  std::nth_element(noise.begin(), middle, noise.end());
  cloud->median_noise = *middle;
  return absl::OkStatus();
}

}  // namespace rilievo
