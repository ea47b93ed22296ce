#include "core/displacement/calibrate_noise.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
// The nearest of so many around the ray: the first that the graph leads to are those of like
// height.
constexpr int kFitPoints = 28, kGatheredPoints = 150;
// Below the middle: edges and bumps within a neighbourhood only ever add to the residual.
constexpr double kQuantile = 0.4;
// Where that quantile of residuals with 22 degrees of freedom lies (Wilson and Hilferty 1931).
constexpr float kQuantileOfNoise = 0.947f;
// A calibration beyond this says that the fits failed, not that the noise was stated wrongly.
constexpr float kMostFactor = 2.5f;

// RMS residual per degree of freedom of the quadric through the queue, or -1.
float QuadricResidual(std::span<const QueuedPoint> queue, float spacing) {
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
  return spacing * static_cast<float>(std::sqrt(std::max(0.0, rest) / freedom));
}

}  // namespace

absl::StatusOr<float> NoiseCalibration(const RayCloud& cloud, const NeighborGraph& graph,
                                       float least_ratio, const RunContext& context) {
  const int64_t count = static_cast<int64_t>(cloud.points.size());
  const int64_t samples = std::min<int64_t>(count, kMostSamples);
  std::vector<float> ratios(samples, -1.0f);
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
      const float residual =
          QuadricResidual(around.first(std::min<size_t>(around.size(), kFitPoints)), point.spacing);
      if (residual >= 0) ratios[s] = residual / point.noise;
    }
  }));
  ratios.erase(std::remove(ratios.begin(), ratios.end(), -1.0f), ratios.end());
  if (ratios.size() < kLeastSamples) return 1.0f;
  const auto middle = ratios.begin() + static_cast<int64_t>(kQuantile * ratios.size());
  std::nth_element(ratios.begin(), middle, ratios.end());
  return std::clamp(*middle / kQuantileOfNoise, 1.0f / kMostFactor, kMostFactor);
}

}  // namespace rilievo
