#include "core/displacement/local_fit/calibrate_noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/displacement/local_fit/normal_equations.h"
#include "core/displacement/rays/neighbor_queue.h"

namespace rilievo {
namespace {

constexpr int kMostSamples = 768;
constexpr size_t kLeastSamples = 32;
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

// Residuals in units of length have the spread of one noise everywhere where quantiles of them,
// taken for noise, agree: a low one and the next of the widest fits, and a high one of the
// smallest, which detail adds to least. Between such ratios to the low one the answer goes from yes
// to no.
constexpr double kLowQuantile = 0.1, kMoreQuantile = 0.25, kHighQuantile = 0.9;
constexpr float kLowOfVariance = 0.6456f, kMoreOfVariance = 0.7886f;  // with 23 degrees of freedom
constexpr float kHighOfVariance = 1.945f;                             // with 4
constexpr float kMoreAgrees = 1.06f, kMoreDisagrees = 1.12f;
constexpr float kHighAgrees = 1.2f, kHighDisagrees = 1.35f;
// Of the samples that must be noisy for that.
constexpr double kLeastNoisyShare = 0.75;
// Noises, in spacings, from which on one noise everywhere is taken for it, in part and wholly. Of
// thinner noise, what the points around a place say also holds what bare triangles leave out.
constexpr float kThinNoise = 0.15f, kThickNoise = 0.25f;
// Over the low quantile: too little noise costs flat faces more than as much too much costs detail.
constexpr float kCaution = 1.04f;

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

struct Sample {
  Residuals residuals;
  float noise, ratio;  // as stated; of it to the spacing
};

template <typename Value>
float Quantile(const std::vector<Sample>& samples, double share, const Value& value) {
  std::vector<float> values;
  values.reserve(samples.size());
  for (const Sample& sample : samples) values.push_back(value(sample));
  const auto at = values.begin() + static_cast<int64_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// What the quantile says of the variance at each size.
Residuals Variances(const std::vector<Sample>& samples) {
  Residuals variances;
  for (size_t k = 0; k < variances.size(); ++k) {
    variances[k] = Quantile(samples, kQuantile, [&](const Sample& s) { return s.residuals[k]; }) /
                   kQuantileOfVariance[k];
  }
  return variances;
}

// How the noise of a point follows from the stated one.
struct Calibration {
  float factor = 1;
  float everywhere = 0;  // one noise for all points, and its share in what is taken
  float share = 0;

  float operator()(float stated) const {
    return share * everywhere + (1 - share) * factor * stated;
  }
};

// The way of the value from `least` to `most`, [0, 1].
float Between(float value, float least, float most) {
  return std::clamp((value - least) / (most - least), 0.0f, 1.0f);
}

// The variance of the noise alone: what neighbourhoods of no size would show, where the residual
// grows with a power of the points (1 on rough surfaces, 3 where a quadric spans smooth detail).
float WithoutDetail(const Residuals& variances) {
  const auto [small, medium, wide] = variances;
  if (!(small > 0)) return wide;
  const float share = Between(wide / small - 1, kGrowsByChance, kGrowsByDetail);
  const float step = wide - medium;
  if (step <= 0) return wide;
  const float least = kGrowth, most = kGrowth * kGrowth * kGrowth;
  const float growth = medium > small ? std::clamp(step / (medium - small), least, most) : most;
  return wide + share * (medium - step / (growth - 1) - wide);
}

Calibration Calibrate(const std::vector<Sample>& samples, double noisy_share) {
  const Residuals variances = Variances(samples);
  const float variance = std::max(0.0f, WithoutDetail(variances));
  Calibration calibration;
  calibration.factor = std::clamp(std::sqrt(variance), kLeastFactor, kMostFactor);
  if (noisy_share < kLeastNoisyShare) return calibration;

  const auto noise_at = [&](double quantile, size_t size, float of_variance) {
    return std::sqrt(
        Quantile(samples, quantile,
                 [&](const Sample& s) { return s.residuals[size] * s.noise * s.noise; }) /
        of_variance);
  };
  const float low = noise_at(kLowQuantile, kFitPoints.size() - 1, kLowOfVariance);
  const float more = noise_at(kMoreQuantile, kFitPoints.size() - 1, kMoreOfVariance);
  const float high = noise_at(kHighQuantile, 0, kHighOfVariance);
  if (!(low > 0)) return calibration;
  const float stated = Quantile(samples, 0.5, [](const Sample& s) { return s.noise; });
  const float ratio = Quantile(samples, 0.5, [](const Sample& s) { return s.ratio; });
  calibration.share = Between(ratio, kThinNoise, kThickNoise) *
                      (1 - Between(more / low, kMoreAgrees, kMoreDisagrees)) *
                      (1 - Between(high / low, kHighAgrees, kHighDisagrees));
  const float without_detail = variance / std::max(variances.back(), variance);
  calibration.everywhere = std::clamp(kCaution * low * std::sqrt(without_detail),
                                      kLeastFactor * stated, kMostFactor * stated);
  return calibration;
}

}  // namespace

absl::Status CalibrateNoise(const NeighborGraph& graph, float least_ratio,
                            const RunContext& context, RayCloud* cloud) {
  if (IsLeftOut(Mechanism::kCalibrateNoise)) return absl::OkStatus();
  const int64_t count = static_cast<int64_t>(cloud->points.size());
  const int64_t tries = std::min<int64_t>(count, kMostSamples);
  std::vector<std::optional<Sample>> found(tries);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(tries, kBlock, context, [&](int64_t begin, int64_t end) {
    NeighborQueue queue(*cloud, graph);
    for (int64_t s = begin; s < end; ++s) {
      const int index = static_cast<int>(s * count / tries);
      const RayPoint& point = cloud->points[index];
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
      // Written so that a residual that is not a number is no sample.
      if (!std::ranges::all_of(residuals, [](float r) { return r >= 0 && std::isfinite(r); }))
        continue;
      found[s] = {residuals, point.noise, point.noise / point.spacing};
    }
  }));
  std::vector<Sample> samples;
  for (const std::optional<Sample>& sample : found) {
    if (sample) samples.push_back(*sample);
  }
  if (samples.size() < kLeastSamples) return absl::OkStatus();
  const Calibration calibration =
      Calibrate(samples, static_cast<double>(samples.size()) / static_cast<double>(tries));
  for (RayPoint& point : cloud->points) point.noise = calibration(point.noise);
  return absl::OkStatus();
}

}  // namespace rilievo
