#include "core/displacement/reach_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
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
// Of the triangle's longest edge: surfaces of few levels are off the points everywhere.
constexpr double kEdges = 0.25;
// Farther off lie strays, and sheets that the domain does not have.
constexpr double kMostSpacings = 4;
// A point of the surface lies on one sheet with the nearest others, an outlier beside one.
constexpr int kNearest = 8;
constexpr double kOffSheet = 0.5;  // spacings, in the median
// A sweep takes the surface to the next points up a tip, where those before were reached. It comes
// to each once: the points of sheets that stand close would pull it in turns.
constexpr int kSweeps = 4;
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
  Reach(const OrientedCloud& cloud, const NeighborGraph& graph, const LoopRefinement& refinement,
        const LevelRings& rings, const LimitSurface& limit, BoundedHeight bounded,
        HeightSamples* samples)
      : cloud_(cloud),
        graph_(graph),
        finest_(refinement.levels.back()),
        rings_(rings),
        limit_(limit),
        bounded_(bounded),
        samples_(*samples) {}

  Vector3d PlaceOf(int v) const {
    return limit_.positions.col(v) + double{samples_.height[v]} * limit_.normals.col(v);
  }

  // How far off a surface of vertices as dense as the points a point may lie.
  double Most(int64_t point) const {
    return std::max(kSpacings * SpacingAt(point),
                    kNoises * std::max<double>(cloud_.noise[point], cloud_.median_noise));
  }

  // The same of a triangle that may be coarser.
  double MostOf(int64_t point, const Corners& corners) const {
    double longest2 = 0;
    for (int k = 0; k < 3; ++k) {
      longest2 = std::max(
          longest2, (limit_.positions.col(corners[k]) - limit_.positions.col(corners[(k + 1) % 3]))
                        .squaredNorm());
    }
    return std::max(Most(point), kEdges * std::sqrt(longest2));
  }

  struct Nearest {
    Corners corners;
    double squared = std::numeric_limits<double>::infinity();
  };
  // The triangle of the finest level that a walk from vertices near `point` ends at.
  Nearest NearestFrom(const Vector3d& point, const Corners& start) const {
    Nearest nearest{start};
    while (const auto nearer = NearerAround(point, nearest.corners, &nearest.squared)) {
      nearest.corners = *nearer;
    }
    return nearest;
  }

  // Whether a point this far from the surface is to be reached.
  bool Wants(int64_t point, double squared, const Corners& nearest) const {
    Vector3d normal = Vector3d::Zero();
    for (const int v : nearest) normal += limit_.normals.col(v);
    const double spacing = SpacingBeside(point, nearest), most = kMostSpacings * spacing;
    return squared <= most * most && normal.dot(cloud_.normals.col(point)) > 0 &&
           OffSheet(point) <= kOffSheet * spacing;
  }

  // Whether heights moved. `off`: of each point of the cloud, whether the surface is off it.
  bool Sweep(std::vector<PassedBy>& passed, std::vector<uint8_t>& off) {
    bool any = false;
    for (PassedBy& one : passed) {
      if (off[one.point] != 0 && LeadsOn(one.point, off)) any |= MoveTo(one, &off[one.point]);
    }
    return any;
  }

 private:
  double SpacingAt(int64_t point) const {
    return std::max<double>(cloud_.spacing[point], cloud_.median_spacing);
  }

  // A stray's own spacing is large: that of the points by the surface counts, where it is known.
  double SpacingBeside(int64_t point, const Corners& nearest) const {
    double spacing = 0;
    for (const int v : nearest) spacing = std::max<double>(spacing, samples_.spacing[v]);
    return spacing > 0 ? std::min(spacing, SpacingAt(point)) : SpacingAt(point);
  }

  // Of the points nearest to one, the median distance from its tangent plane.
  double OffSheet(int64_t point) const {
    std::array<double, kNearest> distances;
    const int count = std::min(kNearest, graph_.k);
    if (count == 0) return 0;
    const NeighborList neighbors = graph_.neighbors(static_cast<int>(point));
    for (int i = 0; i < count; ++i) {
      const Vector3d way = cloud_.points.col(neighbors[i]) - cloud_.points.col(point);
      distances[i] = std::abs(cloud_.normals.col(point).dot(way));
    }
    std::nth_element(distances.begin(), distances.begin() + count / 2, distances.begin() + count);
    return distances[count / 2];
  }

  // From where the surface is: another shell's points are off it one and all.
  bool LeadsOn(int64_t point, const std::vector<uint8_t>& off) const {
    const NeighborList neighbors = graph_.neighbors(static_cast<int>(point));
    for (int i = 0; i < std::min(kNearest, graph_.k); ++i) {
      if (off[neighbors[i]] == 0) return true;
    }
    return false;
  }

  Vector3d WeightsAt(const Vector3d& point, const Corners& corners) const {
    return ClosestWeights(point, PlaceOf(corners[0]), PlaceOf(corners[1]), PlaceOf(corners[2]));
  }

  Vector3d WayTo(const Vector3d& point, const Corners& corners, const Vector3d& weights) const {
    Vector3d way = point;
    for (int k = 0; k < 3; ++k) way -= weights[k] * PlaceOf(corners[k]);
    return way;
  }

  // Of the triangles with one of the corners; empty where none of them is nearer than `*least`.
  std::optional<Corners> NearerAround(const Vector3d& point, const Corners& corners,
                                      double* least) const {
    std::optional<Corners> nearest;
    for (const int v : corners) {
      const Ring ring = rings_.Of(v);
      const int triangles = ring.size() - (finest_.boundary_vertex[v] ? 1 : 0);
      for (int i = 0; i < triangles; ++i) {
        const Corners candidate = {v, ring[i], ring[(i + 1) % ring.size()]};
        const double squared = SquaredDistanceToTriangle(
            point, PlaceOf(candidate[0]), PlaceOf(candidate[1]), PlaceOf(candidate[2]));
        if (!(squared < *least)) continue;
        *least = squared;
        nearest = candidate;
      }
    }
    return nearest;
  }

  // What lies beyond the rim of an open surface is none of its heights'.
  bool IsOnRim(const Corners& corners, const Vector3d& weights) const {
    for (int k = 0; k < 3; ++k) {
      if (weights[k] > 0 && !finest_.boundary_vertex[corners[k]]) return false;
    }
    return true;
  }

  // Descent of the squared distance, along its gradient, to the least on the way. False where no
  // height moved.
  bool MoveTo(PassedBy& passed, uint8_t* off) {
    const Vector3d point = cloud_.points.col(passed.point);
    passed.nearest = NearestFrom(point, passed.nearest).corners;
    const Vector3d weights = WeightsAt(point, passed.nearest);
    const Vector3d way = WayTo(point, passed.nearest, weights);
    const double most = MostOf(passed.point, passed.nearest);
    if (way.squaredNorm() <= most * most) {
      *off = 0;
      return false;
    }
    if (IsOnRim(passed.nearest, weights)) return false;
    Vector3d slope, move = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const Vector3d normal = limit_.normals.col(passed.nearest[k]);
      slope[k] = weights[k] * normal.dot(way);
      move += weights[k] * slope[k] * normal;
    }
    if (!(way.dot(move) > kAlong * way.norm() * move.norm())) return false;
    // A corner far from the place would have to move by many times the way.
    const double step =
        std::min(way.dot(move) / move.squaredNorm(), way.norm() / slope.cwiseAbs().maxCoeff());
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
    if (moved) *off = 0;
    return moved;
  }

  const OrientedCloud& cloud_;
  const NeighborGraph& graph_;
  const MeshTopology& finest_;
  const LevelRings& rings_;
  const LimitSurface& limit_;
  const BoundedHeight bounded_;
  HeightSamples& samples_;
};

}  // namespace

absl::Status ReachPoints(const OrientedCloud& cloud, const NeighborGraph& graph,
                         const LoopRefinement& refinement, const LevelRings& rings,
                         const LimitSurface& limit, BoundedHeight bounded,
                         const RunContext& context, HeightSamples* samples) {
  Reach reach(cloud, graph, refinement, rings, limit, bounded, samples);
  const int64_t count = cloud.points.cols();
  std::vector<uint8_t> off(static_cast<size_t>(count));
  std::vector<std::vector<PassedBy>> blocks(static_cast<size_t>((count + kBlock - 1) / kBlock));
  {
    // The level before shows what is passed by as well, in a quarter of the time and the memory.
    const MeshTopology& coarser = refinement.levels[std::max(0, refinement.max_level() - 1)];
    Eigen::Matrix3Xd places(3, coarser.vertex_count);
    for (int v = 0; v < coarser.vertex_count; ++v) places.col(v) = reach.PlaceOf(v);
    const int brood = coarser.face_count() / refinement.levels[0].face_count();
    RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                             ClosestPointTree::Build(places, coarser.faces, context, brood));
    RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
      for (int64_t p = begin; p < end; ++p) {
        const Vector3d point = cloud.points.col(p);
        const double most = reach.Most(p);
        if (tree.HasWithin(point, most)) continue;
        const auto face = coarser.faces.col(tree.source()[tree.Closest(point).item]);
        const Reach::Nearest nearest = reach.NearestFrom(point, {face[0], face[1], face[2]});
        if (nearest.squared <= most * most) continue;
        off[p] = 1;
        if (!reach.Wants(p, nearest.squared, nearest.corners)) continue;
        blocks[begin / kBlock].push_back({p, nearest.corners});
      }
    }));
  }
  std::vector<PassedBy> passed;
  for (const std::vector<PassedBy>& block : blocks) {
    passed.insert(passed.end(), block.begin(), block.end());
  }
  for (int sweep = 0; sweep < kSweeps && reach.Sweep(passed, off); ++sweep) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  }
  return absl::OkStatus();
}

}  // namespace rilievo
