#include "core/displacement/calibrate_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/displacement/neighbor_queue.h"
#include "core/displacement/normal_equations.h"

namespace rilievo {
namespace {

constexpr int kMostSamples = 768;
constexpr int kLeastSamples = 32;
constexpr int64_t kBlock = 64;
// Quadrics through so many of the points nearest to the ray, each size 1.7 times the one before;
// taken from so many gathered around it: the first that the graph leads to are those of like
// height.
constexpr std::array<size_t, 3> kFitPoints = {10, 17, 29};
constexpr float kGrowth = 1.7f;
constexpr int kGatheredPoints = 150;
// Below the middle: edges and bumps within a neighbourhood only ever add to the residual.
constexpr double kQuantile = 0.4;
// Where that quantile of squared residuals lies with 4, 11 and 23 degrees of freedom.
constexpr std::array<float, 3> kQuantileOfVariance = {0.688f, 0.841f, 0.899f};
// Squared residuals grow so much, from the least size to the widest, by chance and by the edges of
// machined parts; by more only where neighbourhoods span detail.
constexpr float kGrowsByChance = 0.15f, kGrowsByDetail = 0.35f;
// A calibration beyond these says that the fits failed, not that the noise was stated wrongly.
constexpr float kLeastFactor = 0.65f, kMostFactor = 2.5f;

// Squared residual per degree of freedom of the quadric through the queue, or -1.
float SquaredResidual(std::span<const QueuedPoint> queue, float spacing) {
  constexpr int kTerms = 6;
  NormalEquations<kTerms> equations;
  equations.matrix.setZero();
  equations.solution.setZero();
  double squares = 0;
  for (const QueuedPoint& point : queue) {
    const double u = point.u / spacing, v = point.v / spacing, h = point.height / spacing;
    const double basis[kTerms] = {1, u, v, u * u, u * v, v * v};
    for (int a = 0; a < kTerms; ++a) {
      equations.solution[a] += basis[a] * h;
      for (int b = 0; b <= a; ++b) equations.matrix(a, b) += basis[a] * basis[b];
    }
    squares += h * h;
  }
  const auto right_side = equations.solution;
  if (queue.size() <= kTerms || !equations.Solve()) return -1;
  const double rest = squares - equations.solution.dot(right_side);
  const double freedom = static_cast<double>(queue.size()) - kTerms;
  return spacing * spacing * static_cast<float>(std::max(0.0, rest) / freedom);
}

// Squared residuals at the sizes of kFitPoints, in the stated variance.
using Residuals = std::array<float, kFitPoints.size()>;

Residuals ResidualsAround(std::span<const QueuedPoint> around, const RayPoint& point) {
  Residuals residuals;
  for (size_t k = 0; k < kFitPoints.size(); ++k) {
    residuals[k] =
        SquaredResidual(around.first(kFitPoints[k]), point.spacing) / (point.noise * point.noise);
  }
  return residuals;
}

// What the quantile says of the variance at each size.
Residuals Variances(const std::vector<Residuals>& samples) {
  Residuals variances;
  std::vector<float> of_size(samples.size());
  for (size_t k = 0; k < variances.size(); ++k) {
    for (size_t s = 0; s < samples.size(); ++s) of_size[s] = samples[s][k];
    const auto middle = of_size.begin() + static_cast<int64_t>(kQuantile * of_size.size());
    std::nth_element(of_size.begin(), middle, of_size.end());
    variances[k] = *middle / kQuantileOfVariance[k];
  }
  return variances;
}

// The variance of the noise alone: what neighbourhoods of no size would show, where the residual
// grows with a power of the points (1 on rough surfaces, 3 where a quadric spans smooth detail).
float WithoutDetail(const Residuals& variances) {
  const auto [small, medium, wide] = variances;
  if (!(small > 0)) return wide;
  const float share = std::clamp(
      (wide / small - 1 - kGrowsByChance) / (kGrowsByDetail - kGrowsByChance), 0.0f, 1.0f);
  const float step = wide - medium;
  if (step <= 0) return wide;
  const float least = kGrowth, most = kGrowth * kGrowth * kGrowth;
  const float growth = medium > small ? std::clamp(step / (medium - small), least, most) : most;
  return wide + share * (medium - step / (growth - 1) - wide);
}

}  // namespace

absl::StatusOr<float> NoiseCalibration(const RayCloud& cloud, const NeighborGraph& graph,
                                       float least_ratio, const RunContext& context) {
  const int64_t count = static_cast<int64_t>(cloud.points.size());
  const int64_t samples = std::min<int64_t>(count, kMostSamples);
  std::vector<std::optional<Residuals>> found(samples);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(samples, kBlock, context, [&](int64_t begin, int64_t end) {
    NeighborQueue queue(cloud, graph);
    for (int64_t s = begin; s < end; ++s) {
      const int index = static_cast<int>(s * count / samples);
      const RayPoint& point = cloud.points[index];
      const Eigen::Map<const Eigen::Vector3f> position(point.position), normal(point.normal);
      if (!(point.noise > least_ratio * point.spacing) || !normal.allFinite()) continue;
      QueueGate gate;
      gate.max_height = std::numeric_limits<float>::max();
      gate.height_window = 5 * point.noise + point.spacing;
      gate.window_slope = 1;
      queue.Start(MakeRay(position.cast<double>(), normal.cast<double>()), gate, index);
      queue.Grow(kGatheredPoints, std::numeric_limits<float>::max());
      const std::span<const QueuedPoint> around = queue.Sorted();
      if (around.size() < kFitPoints.back()) continue;
      const Residuals residuals = ResidualsAround(around, point);
      if (std::ranges::min(residuals) >= 0) found[s] = residuals;
    }
  }));
  std::vector<Residuals> residuals;
  for (const std::optional<Residuals>& sample : found) {
    if (sample) residuals.push_back(*sample);
  }
  if (residuals.size() < kLeastSamples) return 1.0f;
  const float variance = WithoutDetail(Variances(residuals));
  return std::clamp(std::sqrt(std::max(0.0f, variance)), kLeastFactor, kMostFactor);
}

}  // namespace rilievo
