#include "core/displacement/regularize/project_to_points.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/scratch_pool.h"
#include "core/points/batched_nearest.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int64_t kBlock = 512;
constexpr int kAmid = 8;
constexpr double kMostSpacings = 0.6, kMostNoises = 0.35;
// Where the sides of an edge told the height, which may be a corner of three: .8 in the mean, and
// two deviations.
constexpr double kMostSpacingsOfCreases = 1.2;
// Beside the mean of the points that surround a place; at the rim of a hole all lie to one side.
constexpr double kSurroundedSpacings = 1;
// Other points are the nearest once a height has moved.
constexpr int kRounds = 3;
// A fill this far off the mean of the points nearest to it, in spacings, may have run astray: it
// has where the domain, or a place on the way there, is off theirs by so much less, and near
// points: amid a rim is within a hole.
constexpr double kAstraySpacings = 1, kShareOfAstray = 0.6;
constexpr double kNearSpacings = 1.5;
constexpr std::array<float, 4> kWayBack = {0.75f, 0.5f, 0.25f, 0};

// Heights, some of which come back amid the points around them.
class Projection {
 public:
  Projection(const OrientedCloud& cloud, const LimitSurface& limit, double least_noise,
             HeightSamples* samples)
      : cloud_(cloud), limit_(limit), least_noise_(least_noise), samples_(*samples) {}

  bool Concerns(int64_t v) const { return !samples_.measured[v] || samples_.fitted[v]; }
  Vector3d PlaceOf(int64_t v) const {
    return limit_.positions.col(v) + samples_.height[v] * limit_.normals.col(v);
  }

  // A fill takes its rim's slope along, out of the points where it ran out of a narrow place.
  void BringBack(const PointIndex& index, int64_t v) const {
    const float fill = samples_.height[v];
    if (samples_.measured[v] || fill == 0) return;
    const double astray = OffMean(index, v);
    if (astray < kAstraySpacings) return;
    double least = std::min(kShareOfAstray * astray, kAstraySpacings);
    float best = fill;
    for (const float share : kWayBack) {
      samples_.height[v] = share * fill;
      const double off = OffMean(index, v);
      if (!(off < least)) continue;
      least = off;
      best = samples_.height[v];
    }
    samples_.height[v] = best;
  }

  // `nearest`: of the place, ascending. False where the height stays.
  bool Move(int64_t v, std::span<const int> nearest) const {
    const double spacing = cloud_.spacing[nearest[0]], noise = cloud_.noise[nearest[0]];
    if (!(noise > least_noise_ * spacing)) return false;
    Vector3d mean = Vector3d::Zero();
    for (const int point : nearest) {
      mean += cloud_.points.col(point) / static_cast<double>(nearest.size());
    }
    const Vector3d way = mean - PlaceOf(v);
    const double off = limit_.normals.col(v).dot(way);
    const double aside = (way - off * limit_.normals.col(v)).norm();
    const bool filled = !samples_.measured[v];
    if (filled && aside > kSurroundedSpacings * spacing) return false;
    const double spacings = samples_.crease[v] ? kMostSpacingsOfCreases : kMostSpacings;
    if (!(std::abs(off) > spacings * spacing + kMostNoises * noise)) return false;
    samples_.height[v] += static_cast<float>(off);
    return true;
  }

 private:
  // Distance of the place from the mean of the points nearest to it, in their spacings; infinite
  // where none is near.
  double OffMean(const PointIndex& index, int64_t v) const {
    std::array<int, kAmid> found;
    std::array<double, kAmid> squared;
    const Vector3d place = PlaceOf(v);
    const int count =
        index.Nearest(place, std::min(kAmid, index.size()), found.data(), squared.data());
    if (count == 0) return std::numeric_limits<double>::infinity();
    const double spacing = std::max<double>(cloud_.spacing[found[0]], cloud_.median_spacing);
    if (!(squared[0] < kNearSpacings * kNearSpacings * spacing * spacing)) {
      return std::numeric_limits<double>::infinity();
    }
    Vector3d way = -place;
    for (int i = 0; i < count; ++i) way += cloud_.points.col(found[i]) / count;
    return way.norm() / spacing;
  }

  const OrientedCloud& cloud_;
  const LimitSurface& limit_;
  const double least_noise_;
  HeightSamples& samples_;
};

}  // namespace

absl::Status ProjectToPoints(const OrientedCloud& cloud, const PointIndex& index,
                             const LimitSurface& limit, double least_noise,
                             const RunContext& context, HeightSamples* samples) {
  if (IsLeftOut(Mechanism::kProjectToPoints)) return absl::OkStatus();
  const Projection projection(cloud, limit, least_noise, samples);
  const auto count = static_cast<size_t>(std::min(kAmid, index.size()));
  const BatchedNearest prototype(index, cloud.points, static_cast<int>(count));
  ScratchPool<BatchedNearest> pool(prototype);
  return ParallelFor(samples->size(), kBlock, context, [&](int64_t begin, int64_t end) {
    std::vector<int64_t> vertices;
    Eigen::Matrix3Xd places(3, end - begin);
    for (int64_t v = begin; v < end; ++v) {
      if (!projection.Concerns(v)) continue;
      projection.BringBack(index, v);
      places.col(static_cast<int64_t>(vertices.size())) = projection.PlaceOf(v);
      vertices.push_back(v);
    }
    std::array<int, kAmid> found;
    std::array<double, kAmid> squared;
    const auto move = [&](int64_t i, const int* nearest, const double*) {
      bool moved = projection.Move(vertices[i], {nearest, count});
      for (int round = 1; moved && round < kRounds; ++round) {
        index.Nearest(projection.PlaceOf(vertices[i]), kAmid, found.data(), squared.data());
        moved = projection.Move(vertices[i], {found.data(), count});
      }
    };
    pool.Take()->OfEach(places, 0, static_cast<int64_t>(vertices.size()), move);
  });
}

}  // namespace rilievo
