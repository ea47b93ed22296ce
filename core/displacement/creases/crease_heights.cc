#include "core/displacement/creases/crease_heights.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/points/edge_model/two_plane_model.h"
#include "core/points/point_support.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int64_t kBlock = 64;
// Sides are believed so far from the middle of their fit, as a share of its reach.
constexpr double kBelieved = 0.4;
// Twice the log-likelihood ratio of two sides and a quadric from which they are believed.
constexpr double kLeastEvidence = 40;
// Least cosine of the normals of a vertex and of its side.
constexpr double kOwnSide = 0.85;
// Deviation of a plane through so many points, in noises.
constexpr float kPlaneDeviation = 0.3f;
// Heights that depart less from what was measured are believed, and the points around the others
// asked: how far off the sides they may be in the mean, and from the place.
constexpr double kTrustedNoises = 0.5;
constexpr int kJudges = 12;
constexpr double kMostOffNoises = 0.6;
constexpr double kReachSpacings = 1.0;

struct Source {
  int vertex, foot;
  std::array<Vector3d, 2> normals;
  std::optional<TwoPlaneModel> planes;
};

// Column s of the sector normals belongs to sectors.vertices[s].
std::vector<Source> SourcesOf(const SharpSectors& sectors, const LimitSurface& limit,
                              const std::vector<uint8_t>& wanted) {
  std::vector<Source> sources;
  for (int s = 0; s + 1 < sectors.size(); ++s) {
    const int v = sectors.vertices[s];
    const bool two = sectors.vertices[s + 1] == v && (s == 0 || sectors.vertices[s - 1] != v) &&
                     (s + 2 >= sectors.size() || sectors.vertices[s + 2] != v);
    if (!two || wanted[v] == 0) continue;
    sources.push_back(
        {v, -1, {limit.sector_normals.col(s), limit.sector_normals.col(s + 1)}, std::nullopt});
  }
  return sources;
}

EdgePlace PlaceOf(const Source& source, const LevelRings& rings, const LimitSurface& limit) {
  EdgePlace place;
  place.middle = limit.positions.col(source.vertex);
  place.normal = source.normals;
  place.along = source.normals[0].cross(source.normals[1]).normalized();
  Vector3d around = Vector3d::Zero();
  for (const int neighbor : rings.Of(source.vertex)) {
    around += limit.positions.col(neighbor) - place.middle;
  }
  const bool convex = around.dot(source.normals[0] + source.normals[1]) < 0;
  for (int k = 0; k < 2; ++k) {
    const Vector3d& own = source.normals[k];
    const Vector3d way = source.normals[1 - k] - own * own.dot(source.normals[1 - k]);
    place.inward[k] = (convex ? -way : way).normalized();
  }
  return place;
}

HeightEstimate Estimate(const Source& source, double height, const OrientedCloud& cloud,
                        bool crease) {
  return {static_cast<float>(height),
          kPlaneDeviation * static_cast<float>(cloud.noise[source.foot]),
          static_cast<float>(source.planes->spacing),
          source.foot,
          crease,
          true};
}

// Where the sides meet: the height that comes nearest to both planes.
std::optional<double> HeightOnCrease(const TwoPlaneModel& planes, const Vector3d& position,
                                     const Vector3d& direction) {
  double right = 0, left = 0;
  for (int k = 0; k < 2; ++k) {
    const HingePlane plane = planes.TangentAt(k, position);
    const double slope = direction.dot(plane.normal);
    right += slope * (plane.offset - plane.normal.dot(position));
    left += slope * slope;
  }
  if (!(left > 0.05)) return std::nullopt;
  return right / left;
}

// Whether the points around `place` are off the two sides to one way: a third one passes there.
bool AreOffSides(const TwoPlaneModel& planes, const OrientedCloud& cloud, const PointIndex& index,
                 const Vector3d& place) {
  std::array<int, kJudges> found;
  std::array<double, kJudges> squared;
  const int count =
      index.Nearest(place, std::min(kJudges, index.size()), found.data(), squared.data());
  const HingePlane a = planes.TangentAt(0, place), b = planes.TangentAt(1, place);
  double convex = 0, concave = 0, convex_squares = 0, concave_squares = 0;
  for (int i = 0; i < count; ++i) {
    const Vector3d at = cloud.points.col(found[i]);
    const auto [less, more] =
        std::minmax({a.normal.dot(at) - a.offset, b.normal.dot(at) - b.offset});
    convex += more;
    convex_squares += more * more;
    concave += less;
    concave_squares += less * less;
  }
  const double mean = (convex_squares < concave_squares ? convex : concave) / count;
  return std::abs(mean) > kMostOffNoises * cloud.noise[found[0]];
}

// On the side that the vertex faces as.
std::optional<double> HeightBeside(const TwoPlaneModel& planes, const Vector3d& position,
                                   const Vector3d& direction) {
  const int side =
      direction.dot(planes.sides[0].normal) > direction.dot(planes.sides[1].normal) ? 0 : 1;
  const HingePlane plane = planes.TangentAt(side, position);
  const double slope = direction.dot(plane.normal);
  if (slope < kOwnSide) return std::nullopt;
  return (plane.offset - plane.normal.dot(position)) / slope;
}

}  // namespace

absl::StatusOr<std::vector<CreaseHeight>> HeightsBesideCreases(
    const OrientedCloud& cloud, const PointIndex& index, const LevelRings& rings,
    const LimitSurface& limit, const SharpSectors& sectors, const std::vector<uint8_t>& wanted,
    const HeightSamples& samples, const RunContext& context) {
  if (IsLeftOut(Mechanism::kCreaseHeights)) return std::vector<CreaseHeight>();
  std::vector<Source> sources = SourcesOf(sectors, limit, wanted);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(
      static_cast<int64_t>(sources.size()), kBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          Source& source = sources[i];
          const EdgePlace place = PlaceOf(source, rings, limit);
          double squared = 0;
          index.Nearest(place.middle, 1, &source.foot, &squared);
          if (!place.along.allFinite() || place.along.isZero()) continue;
          source.planes = FitTwoPlaneModel(cloud, index, place, SideBias::kRemoved);
          if (source.planes && !(source.planes->log_likelihood_ratio > kLeastEvidence))
            source.planes.reset();
        }
      }));
  // Rings around the sources in turn: each vertex takes the first source that reaches it.
  constexpr int kNone = -1;
  std::vector<int> source_of(wanted.size(), kNone), front, next;
  std::vector<CreaseHeight> heights;
  for (size_t i = 0; i < sources.size(); ++i) {
    const int v = sources[i].vertex;
    source_of[v] = static_cast<int>(i);
    if (!sources[i].planes) continue;
    const auto height =
        HeightOnCrease(*sources[i].planes, limit.positions.col(v), limit.normals.col(v));
    if (height) heights.push_back({v, Estimate(sources[i], *height, cloud, true)});
    front.push_back(v);
  }
  for (const int v : sectors.vertices) {
    if (source_of[v] == kNone) source_of[v] = static_cast<int>(sources.size());
  }
  for (; !front.empty(); front.swap(next)) {
    next.clear();
    for (const int v : front) {
      const Source& source = sources[source_of[v]];
      for (const int u : rings.Of(v)) {
        if (source_of[u] != kNone) continue;
        const Vector3d position = limit.positions.col(u);
        if ((position - source.planes->middle).norm() > kBelieved * source.planes->reach) continue;
        const auto height = HeightBeside(*source.planes, position, limit.normals.col(u));
        if (!height) continue;
        source_of[u] = source_of[v];
        heights.push_back({u, Estimate(source, *height, cloud, false)});
        next.push_back(u);
      }
    }
  }
  std::vector<uint8_t> contradicted(heights.size(), 0);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(
      static_cast<int64_t>(heights.size()), kBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          const auto& [v, estimate] = heights[i];
          const double way = std::abs(samples.height[v] - estimate.height);
          if (samples.measured[v] && way < kTrustedNoises * cloud.noise[estimate.foot]) continue;
          const Vector3d place = limit.positions.col(v) + estimate.height * limit.normals.col(v);
          contradicted[i] = AreOffSides(*sources[source_of[v]].planes, cloud, index, place) ||
                            !HasSupport(cloud, index, place, kReachSpacings);
        }
      }));
  std::vector<CreaseHeight> believed;
  for (size_t i = 0; i < heights.size(); ++i) {
    if (!contradicted[i]) believed.push_back(heights[i]);
  }
  std::sort(believed.begin(), believed.end(),
            [](const CreaseHeight& a, const CreaseHeight& b) { return a.vertex < b.vertex; });
  return believed;
}

}  // namespace rilievo
