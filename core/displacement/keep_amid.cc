#include "core/displacement/keep_amid.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/parallel_for.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int64_t kBlock = 512;
constexpr int kAmid = 8;
constexpr double kMostSpacings = 0.6, kMostNoises = 0.35;
// Where the sides of an edge told the height, which may be a corner of three.
constexpr double kMostSpacingsOfCreases = 0.9;
// Other points are the nearest once a height has moved.
constexpr int kRounds = 3;

}  // namespace

absl::Status KeepAmidPoints(const OrientedCloud& cloud, const PointIndex& index,
                            const LimitSurface& limit, double least_noise,
                            const RunContext& context, HeightSamples* samples) {
  return ParallelFor(samples->size(), kBlock, context, [&](int64_t begin, int64_t end) {
    std::array<int, kAmid> found;
    std::array<double, kAmid> squared;
    for (int64_t v = begin; v < end; ++v) {
      if (samples->measured[v] && !samples->fitted[v]) continue;
      const double spacings = samples->crease[v] ? kMostSpacingsOfCreases : kMostSpacings;
      const Vector3d origin = limit.positions.col(v), direction = limit.normals.col(v);
      for (int round = 0; round < kRounds; ++round) {
        const Vector3d place = origin + samples->height[v] * direction;
        const int count =
            index.Nearest(place, std::min(kAmid, index.size()), found.data(), squared.data());
        const double spacing = cloud.spacing[found[0]], noise = cloud.noise[found[0]];
        if (!(noise > least_noise * spacing)) break;
        Vector3d mean = Vector3d::Zero();
        for (int i = 0; i < count; ++i) mean += cloud.points.col(found[i]) / count;
        const double off = direction.dot(mean - place);
        if (!(std::abs(off) > spacings * spacing + kMostNoises * noise)) break;
        samples->height[v] += static_cast<float>(off);
      }
    }
  });
}

}  // namespace rilievo
