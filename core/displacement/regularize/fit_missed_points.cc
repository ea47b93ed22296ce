#include "core/displacement/regularize/fit_missed_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/base/ablation.h"
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
// A point of the surface lies on one sheet with the nearest others, an outlier beside one, and is
// led to from these.
constexpr int kSheetNeighbors = 8;
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
  bool was_come_to = false;
};

class PointReacher {
 public:
  PointReacher(const OrientedCloud& cloud, const NeighborGraph& graph,
               const LoopRefinement& refinement, const LevelRings& rings, const LimitSurface& limit,
               BoundedHeight bounded, HeightSamples* samples)
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

  struct Nearest {
    Corners corners;
    double squared = std::numeric_limits<double>::infinity();
  };

  // The same of a triangle that may be coarser.
  bool IsWithin(int64_t point, const Nearest& nearest) const {
    double longest2 = 0;
    for (int k = 0; k < 3; ++k) {
      const int from = nearest.corners[k], to = nearest.corners[(k + 1) % 3];
      longest2 =
          std::max(longest2, (limit_.positions.col(from) - limit_.positions.col(to)).squaredNorm());
    }
    const double most = Most(point);
    return nearest.squared <= std::max(most * most, kEdges * kEdges * longest2);
  }

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

  // Whether the surface came to any. `off`: of each point of the cloud, whether the surface is off
  // it.
  absl::StatusOr<bool> Sweep(std::vector<PassedBy>& passed, std::vector<uint8_t>& off,
                             const RunContext& context) {
    constexpr size_t kPointsBetweenStops = 4096;
    bool any = false;
    for (size_t i = 0; i < passed.size(); ++i) {
      if (i % kPointsBetweenStops == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      PassedBy& one = passed[i];
      uint8_t& is_off = off[one.point];
      if (one.was_come_to || is_off == 0 || !IsLedTo(one, off)) continue;
      if (!HasSupport(one)) one.was_come_to = MoveTo(one);
      if (HasSupport(one)) is_off = 0;
      any |= one.was_come_to || is_off == 0;
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

  // Of `other` from the tangent plane of `point`.
  double OffPlane(int64_t point, int other) const {
    const Vector3d way = cloud_.points.col(other) - cloud_.points.col(point);
    return std::abs(cloud_.normals.col(point).dot(way));
  }

  // Of the points nearest to one, the median distance from its tangent plane.
  double OffSheet(int64_t point) const {
    std::array<double, kSheetNeighbors> distances;
    const int count = std::min(kSheetNeighbors, graph_.k);
    if (count == 0) return 0;
    const NeighborList neighbors = graph_.neighbors(static_cast<int>(point));
    for (int i = 0; i < count; ++i) distances[i] = OffPlane(point, neighbors[i]);
    std::nth_element(distances.begin(), distances.begin() + count / 2, distances.begin() + count);
    return distances[count / 2];
  }

  // From a neighbour on its sheet to which the surface comes: another shell's points are off it one
  // and all.
  bool IsLedTo(const PassedBy& passed, const std::vector<uint8_t>& off) const {
    const int point = static_cast<int>(passed.point);
    const double most = kOffSheet * SpacingBeside(passed.point, passed.nearest);
    const NeighborList neighbors = graph_.neighbors(point);
    for (int i = 0; i < std::min(kSheetNeighbors, graph_.k); ++i) {
      if (off[neighbors[i]] == 0 && OffPlane(point, neighbors[i]) <= most) return true;
    }
    return false;
  }

  // Follows the surface to the triangle now nearest to the point.
  bool HasSupport(PassedBy& passed) const {
    const Nearest nearest = NearestFrom(cloud_.points.col(passed.point), passed.nearest);
    passed.nearest = nearest.corners;
    return IsWithin(passed.point, nearest);
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

  // What lies beyond the rim of an open surface is none of its heights'. Corners of a rim's
  // triangle that all lie on it do not make a place within that one.
  bool IsOnRim(const Corners& corners, const Vector3d& weights) const {
    int off = 0;
    for (int k = 0; k < 3; ++k) {
      if (!(weights[k] > 0)) {
        ++off;
      } else if (!finest_.boundary_vertex[corners[k]]) {
        return false;
      }
    }
    return off > 0;
  }

  // Descent of the squared distance, along its gradient, to the least on the way. False where no
  // height moved.
  bool MoveTo(const PassedBy& passed) {
    const Vector3d point = cloud_.points.col(passed.point);
    const Vector3d weights = WeightsAt(point, passed.nearest);
    const Vector3d way = WayTo(point, passed.nearest, weights);
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

absl::Status FitMissedPoints(const OrientedCloud& cloud, const NeighborGraph& graph,
                             const LoopRefinement& refinement, const LevelRings& rings,
                             const LimitSurface& limit, BoundedHeight bounded,
                             const RunContext& context, HeightSamples* samples) {
  if (IsLeftOut(Mechanism::kMissedPoints)) return absl::OkStatus();
  PointReacher reacher(cloud, graph, refinement, rings, limit, bounded, samples);
  const int64_t count = cloud.points.cols();
  std::vector<uint8_t> off(static_cast<size_t>(count));
  std::vector<std::vector<PassedBy>> blocks(static_cast<size_t>((count + kBlock - 1) / kBlock));
  {
    // The level before shows what is passed by, tips and webs, in a quarter of the time and the
    // memory.
    const MeshTopology& coarser = refinement.levels[std::max(0, refinement.max_level() - 1)];
    Eigen::Matrix3Xd places(3, coarser.vertex_count);
    for (int v = 0; v < coarser.vertex_count; ++v) places.col(v) = reacher.PlaceOf(v);
    const int children_per_face = coarser.face_count() / refinement.levels[0].face_count();
    RILIEVO_ASSIGN_OR_RETURN(
        const ClosestPointTree tree,
        ClosestPointTree::Build(places, coarser.faces, context, children_per_face));
    RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kBlock, context, [&](int64_t begin, int64_t end) {
      for (int64_t p = begin; p < end; ++p) {
        const Vector3d point = cloud.points.col(p);
        const double most = reacher.Most(p);
        if (tree.HasWithin(point, most)) continue;
        const auto face = coarser.faces.col(tree.source()[tree.Closest(point).item]);
        const PointReacher::Nearest nearest =
            reacher.NearestFrom(point, {face[0], face[1], face[2]});
        if (reacher.IsWithin(p, nearest)) continue;
        off[p] = 1;
        if (!reacher.Wants(p, nearest.squared, nearest.corners)) continue;
        blocks[begin / kBlock].push_back({p, nearest.corners});
      }
    }));
  }
  std::vector<PassedBy> passed;
  for (std::vector<PassedBy>& block : blocks) {
    passed.insert(passed.end(), block.begin(), block.end());
    block = {};
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    RILIEVO_ASSIGN_OR_RETURN(const bool any, reacher.Sweep(passed, off, context));
    if (!any) break;
  }
  return absl::OkStatus();
}

}  // namespace rilievo
