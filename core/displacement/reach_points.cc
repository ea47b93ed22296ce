#include "core/displacement/reach_points.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/triangle_distance.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int64_t kBlock = 4096;
// A surface through the vertices is off the points between them by less.
constexpr double kSpacings = 0.5, kNoises = 6;
// Farther off lie strays, and sheets that the domain does not have.
constexpr double kMostSpacings = 4;
// Most of what is passed by is reached in the first sweep; what moved may leave another behind.
constexpr int kSweeps = 3;
// Least cosine between the way to a point and that on which heights come nearer to it.
constexpr double kAlong = 0.5;

using Corners = std::array<int, 3>;

// A point that the surface passes by, and a triangle that is or was the nearest to it.
struct PassedBy {
  int64_t point;
  Corners nearest;
};

class Reach {
 public:
  Reach(const OrientedCloud& cloud, const LoopRefinement& refinement, const LevelRings& rings,
        const LimitSurface& limit, BoundedHeight bounded, HeightSamples* samples)
      : cloud_(cloud),
        finest_(refinement.levels.back()),
        rings_(rings),
        limit_(limit),
        bounded_(bounded),
        samples_(*samples) {}

  Vector3d PlaceOf(int v) const {
    return limit_.positions.col(v) + double{samples_.height[v]} * limit_.normals.col(v);
  }

  // How far off the surface a point may lie.
  double Most(int64_t point) const {
    return std::max(kSpacings * SpacingAt(point),
                    kNoises * std::max<double>(cloud_.noise[point], cloud_.median_noise));
  }

  bool IsOfAnotherPlace(int64_t point, double squared, const Corners& nearest) const {
    const double most = kMostSpacings * SpacingAt(point);
    Vector3d normal = Vector3d::Zero();
    for (const int v : nearest) normal += limit_.normals.col(v);
    return squared > most * most || !(normal.dot(cloud_.normals.col(point)) > 0);
  }

  // Whether heights moved.
  bool Sweep(std::vector<PassedBy>& passed) {
    bool any = false;
    for (PassedBy& one : passed) any |= MoveTo(one);
    return any;
  }

 private:
  double SpacingAt(int64_t point) const {
    return std::max<double>(cloud_.spacing[point], cloud_.median_spacing);
  }

  Vector3d WeightsAt(const Vector3d& point, const Corners& corners) const {
    return ClosestWeights(point, PlaceOf(corners[0]), PlaceOf(corners[1]), PlaceOf(corners[2]));
  }

  Vector3d WayTo(const Vector3d& point, const Corners& corners, const Vector3d& weights) const {
    Vector3d way = point;
    for (int k = 0; k < 3; ++k) way -= weights[k] * PlaceOf(corners[k]);
    return way;
  }

  // Of the triangles with one of the corners.
  Corners NearestAround(const Vector3d& point, const Corners& corners) const {
    Corners nearest = corners;
    double least = std::numeric_limits<double>::infinity();
    for (const int v : corners) {
      const Ring ring = rings_.Of(v);
      const int triangles = ring.size() - (finest_.boundary_vertex[v] ? 1 : 0);
      for (int i = 0; i < triangles; ++i) {
        const Corners candidate = {v, ring[i], ring[(i + 1) % ring.size()]};
        const double squared = SquaredDistanceToTriangle(
            point, PlaceOf(candidate[0]), PlaceOf(candidate[1]), PlaceOf(candidate[2]));
        if (!(squared < least)) continue;
        least = squared;
        nearest = candidate;
      }
    }
    return nearest;
  }

  // Descent of the squared distance, along its gradient, to the least on the way.
  bool MoveTo(PassedBy& passed) {
    const Vector3d point = cloud_.points.col(passed.point);
    passed.nearest = NearestAround(point, passed.nearest);
    const Vector3d weights = WeightsAt(point, passed.nearest);
    const Vector3d way = WayTo(point, passed.nearest, weights);
    const double most = Most(passed.point);
    if (way.squaredNorm() <= most * most) return false;
    Vector3d slope, move = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const Vector3d normal = limit_.normals.col(passed.nearest[k]);
      slope[k] = weights[k] * normal.dot(way);
      move += weights[k] * slope[k] * normal;
    }
    if (!(way.dot(move) > kAlong * way.norm() * move.norm())) return false;
    // A corner far from the place would have to move by many times the way.
    const double step = std::min(way.dot(move) / move.squaredNorm(),
                                 way.norm() / slope.cwiseAbs().maxCoeff());
    bool moved = false;
    for (int k = 0; k < 3; ++k) {
      if (slope[k] == 0) continue;
      const int v = passed.nearest[k];
      const float before = samples_.height[v];
      const float after = bounded_(v, before + static_cast<float>(step * slope[k]));
      if (after == before) continue;
      samples_.height[v] = after;
      samples_.measured[v] = samples_.fitted[v] = 1;
      moved = true;
    }
    return moved;
  }

  const OrientedCloud& cloud_;
  const MeshTopology& finest_;
  const LevelRings& rings_;
  const LimitSurface& limit_;
  const BoundedHeight bounded_;
  HeightSamples& samples_;
};

}  // namespace

absl::Status ReachPoints(const OrientedCloud& cloud, const LoopRefinement& refinement,
                         const LevelRings& rings, const LimitSurface& limit, BoundedHeight bounded,
                         const RunContext& context, HeightSamples* samples) {
  Reach reach(cloud, refinement, rings, limit, bounded, samples);
  const int64_t count = cloud.points.cols();
  std::vector<std::vector<PassedBy>> blocks(static_cast<size_t>((count + kBlock - 1) / kBlock));
  {
    const Eigen::Matrix3Xi faces = FinestFaces(refinement);
    Eigen::Matrix3Xd places(3, samples->size());
    for (int v = 0; v < samples->size(); ++v) places.col(v) = reach.PlaceOf(v);
    RILIEVO_ASSIGN_OR_RETURN(
        const ClosestPointTree tree,
        ClosestPointTree::Build(places, faces, context, 1 << (2 * refinement.max_level())));
    RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
      for (int64_t p = begin; p < end; ++p) {
        const Vector3d point = cloud.points.col(p);
        if (tree.HasWithin(point, reach.Most(p))) continue;
        const ClosestPointTree::Hit hit = tree.Closest(point);
        const auto face = faces.col(tree.source()[hit.item]);
        const Corners corners = {face[0], face[1], face[2]};
        if (reach.IsOfAnotherPlace(p, hit.squared_distance, corners)) continue;
        blocks[begin / kBlock].push_back({p, corners});
      }
    }));
  }
  std::vector<PassedBy> passed;
  for (const std::vector<PassedBy>& block : blocks) {
    passed.insert(passed.end(), block.begin(), block.end());
  }
  for (int sweep = 0; sweep < kSweeps && reach.Sweep(passed); ++sweep) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  }
  return absl::OkStatus();
}

}  // namespace rilievo
