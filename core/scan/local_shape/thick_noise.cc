#include "core/scan/local_shape/thick_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/points/settings.h"
#include "core/scan/local_shape/quadric_residual.h"
#include "core/scan/local_shape/settings.h"

namespace rilievo {
namespace {

// How many points there are to be in it where noise is so many spacings thick.
int BallFor(double ratio) {
  return static_cast<int>(std::min(kThickNoise.fit_points + kThickNoise.ball_growth * ratio * ratio,
                                   double{kThickNoise.most_ball_points}));
}

// The points nearest to `center` along its tangent plane.
std::vector<int> AlongTangentPlane(const OrientedCloud& cloud, const PointIndex& index, int center,
                                   int wanted) {
  std::array<int, kThickNoise.most_ball_points> ball;
  std::array<double, kThickNoise.most_ball_points> squared;
  const Eigen::Vector3d at = cloud.points.col(center), normal = cloud.normals.col(center);
  const int found = index.Nearest(at, std::min(wanted, index.size()), ball.data(), squared.data());
  std::vector<std::pair<double, int>> along;
  for (int i = 0; i < found; ++i) {
    if (ball[i] == center || cloud.normals.col(ball[i]).dot(normal) < kThickNoise.least_agreement)
      continue;
    const double height = normal.dot(cloud.points.col(ball[i]) - at);
    along.emplace_back(squared[i] - height * height, ball[i]);
  }
  if (along.size() > kThickNoise.fit_points) {
    std::nth_element(along.begin(), along.begin() + kThickNoise.fit_points, along.end());
    along.resize(kThickNoise.fit_points);
  }
  std::vector<int> points;
  for (const auto& [square, point] : along) points.push_back(point);
  return points;
}

double NoiseAlong(const OrientedCloud& cloud, const PointIndex& index, int center, int ball) {
  const std::vector<int> points = AlongTangentPlane(cloud, index, center, ball);
  if (points.size() < kThickNoise.fit_points / 2) return -1;
  double radius = 0;
  for (const int point : points) {
    radius = std::max(radius, (cloud.points.col(point) - cloud.points.col(center)).norm());
  }
  return QuadricResidual(cloud.points, center, points, radius, cloud.normals.col(center));
}

absl::StatusOr<double> FindScale(const OrientedCloud& cloud, const PointIndex& index,
                                 const RunContext& context) {
  const int64_t count = cloud.points.cols();
  const int64_t samples = std::min<int64_t>(count, kThickNoise.most_samples);
  std::vector<double> ratios(static_cast<size_t>(samples), -1);
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(samples, kHeavyBlock, context, [&](int64_t s) {
    const int point = static_cast<int>(s * count / samples);
    const double noise = cloud.noise[point], spacing = cloud.spacing[point];
    if (!(noise > kThickNoise.understated_noise * spacing)) return;
    double ratio = noise / spacing;
    for (int look = 0; look < kThickNoise.looks; ++look) {
      const double found = NoiseAlong(cloud, index, point, BallFor(ratio));
      if (found < 0) return;
      ratios[s] = found / noise;
      if (found <= ratio * spacing) return;
      ratio = found / spacing;
    }
  }));
  ratios.erase(std::remove(ratios.begin(), ratios.end(), -1.0), ratios.end());
  if (ratios.size() < kThickNoise.least_samples) return 1.0;
  const auto middle = ratios.begin() + static_cast<int64_t>(kThickNoise.quantile *
                                                            static_cast<double>(ratios.size()));
  std::nth_element(ratios.begin(), middle, ratios.end());
  return std::clamp(*middle, 1.0, kThickNoise.most_scale);
}

}  // namespace

absl::Status CorrectThickNoise(const PointIndex& index, const RunContext& context,
                               OrientedCloud* cloud) {
  if (IsLeftOut(Mechanism::kThickNoise)) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(const double scale, FindScale(*cloud, index, context));
  if (scale == 1) return absl::OkStatus();
  for (size_t i = 0; i < cloud->noise.size(); ++i) {
    const double ratio = cloud->noise[i] / std::max(double{cloud->spacing[i]}, 1e-30);
    const double share = std::clamp((ratio - kThickNoise.understated_noise) /
                                        (kCommon.thick_noise_ratio - kThickNoise.understated_noise),
                                    0.0, 1.0);
    cloud->noise[i] *= static_cast<float>(1 + share * (scale - 1));
  }
  std::vector<float> noise = cloud->noise;
  const auto middle = noise.begin() + static_cast<int64_t>((noise.size() - 1) / 2);
  std::nth_element(noise.begin(), middle, noise.end());
  cloud->median_noise = *middle;
  return absl::OkStatus();
}

}  // namespace rilievo
