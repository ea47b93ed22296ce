#include "core/displacement/feet/point_feet.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "core/base/parallel_for.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"
#include "core/displacement/feet/settings.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/triangle_distance.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Corners = std::array<int, 3>;

// What is nearest is looked for on the level before the finest, which has a quarter of the
// triangles.
int SearchLevel(const LoopRefinement& refinement) {
  return std::max(0, refinement.max_level() - 1);
}

// `places`: of the vertices of that level.
absl::StatusOr<ClosestPointTree> SearchTree(const LoopRefinement& refinement,
                                            const Eigen::Matrix3Xd& places,
                                            const RunContext& context) {
  const MeshTopology& level = refinement.levels[SearchLevel(refinement)];
  return ClosestPointTree::Over(places, level.faces, context,
                                level.face_count() / refinement.levels.front().face_count());
}

// A point in the coordinates of a prism.
struct PrismPlace {
  Vector3d weight = Vector3d::Constant(1.0 / 3);  // barycentric, of the corners
  double height = 0;
};

class FootFinder {
 public:
  FootFinder(const OrientedCloud& cloud, const LevelRings& rings, const MeshTopology& finest,
             const LimitSurface& limit, const DisplacementOptions& options)
      : cloud_(cloud), rings_(rings), finest_(finest), limit_(limit), options_(options) {}

  // Walks from a triangle at vertex `start` towards the prism that holds the point.
  std::optional<PointFoot> Walk(int64_t point, int start) const {
    const Vector3d p = cloud_.points.col(point);
    const Ring ring = rings_.Of(start);
    Corners corners = {start, ring[0], ring[1]};
    PrismPlace place;
    place.height = (p - limit_.positions.col(start)).dot(limit_.normals.col(start));
    for (int step = 0; step < kFeet.walk_steps; ++step) {
      const bool met = Invert(p, corners, &place);
      if (!StepTowards(place.weight, &corners)) {
        // In it, or less than a triangle beyond a rim.
        const bool near = place.weight.minCoeff() >= -1;
        return met && near ? FootAt(point, corners, place) : std::nullopt;
      }
      place.weight.setConstant(1.0 / 3);
    }
    return std::nullopt;
  }

 private:
  // Over the edge that the place lies farthest beyond, rims left out. False where there is none.
  bool StepTowards(const Vector3d& weight, Corners* corners) const {
    std::array<int, 3> order = {0, 1, 2};
    std::sort(order.begin(), order.end(), [&](int a, int b) { return weight[a] < weight[b]; });
    for (const int out : order) {
      if (weight[out] >= -kFeet.outside) return false;
      const int next =
          Across((*corners)[(out + 1) % 3], (*corners)[(out + 2) % 3], (*corners)[out]);
      if (next < 0) continue;
      (*corners)[out] = next;
      return true;
    }
    return false;
  }

  // Newton's method from the place given; whether it arrived.
  bool Invert(const Vector3d& point, const Corners& c, PrismPlace* place) const {
    const Vector3d s = limit_.positions.col(c[0]), n = limit_.normals.col(c[0]);
    const Vector3d s1 = limit_.positions.col(c[1]) - s, s2 = limit_.positions.col(c[2]) - s;
    const Vector3d n1 = limit_.normals.col(c[1]) - n, n2 = limit_.normals.col(c[2]) - n;
    const double near = kFeet.arrived * s1.norm();
    Vector3d at(place->weight[1], place->weight[2], place->height);
    bool arrived = false;
    for (int step = 0; step <= kFeet.newton_steps; ++step) {
      const Vector3d normal = n + at[0] * n1 + at[1] * n2;
      const Vector3d off = s + at[0] * s1 + at[1] * s2 + at[2] * normal - point;
      arrived = off.norm() < near;
      if (off.norm() < 0.1 * near || step == kFeet.newton_steps) break;
      Eigen::Matrix3d slope;
      slope << s1 + at[2] * n1, s2 + at[2] * n2, normal;
      const Vector3d move = slope.inverse() * off;
      if (!move.allFinite()) break;
      at -= move;
      if (at.head<2>().cwiseAbs().maxCoeff() > kFeet.farthest) break;
    }
    at.head<2>() = at.head<2>().cwiseMax(-kFeet.farthest).cwiseMin(kFeet.farthest);
    place->weight << 1 - at[0] - at[1], at[0], at[1];
    place->height = std::clamp(at[2], -1.0, 1.0);
    return arrived;
  }

  std::optional<PointFoot> FootAt(int64_t point, const Corners& corners,
                                  const PrismPlace& place) const {
    const Vector3d& weight = place.weight;
    const Vector3d normal = cloud_.normals.col(point);
    Vector3d mean = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) mean += weight[k] * limit_.normals.col(corners[k]);
    if (!(mean.normalized().dot(normal) > options_.min_normal_agreement) ||
        !(std::abs(place.height) <= options_.max_height)) {
      return std::nullopt;
    }
    PointFoot foot;
    foot.corner = corners;
    for (int k = 0; k < 3; ++k) {
      foot.weight[k] = static_cast<float>(weight[k] * limit_.normals.col(corners[k]).dot(normal));
    }
    foot.offset = static_cast<float>(place.height * mean.dot(normal));
    return foot;
  }

  // The corner opposite `from` over edge a b; -1 beyond a rim.
  int Across(int a, int b, int from) const {
    const Ring ring = rings_.Of(a);
    const int size = ring.size();
    const int place = static_cast<int>(std::find(ring.begin(), ring.end(), b) - ring.begin());
    const bool open = finest_.boundary_vertex[a] != 0;
    const int after = place + 1 < size ? ring[place + 1] : open ? -1 : ring[0];
    const int before = place > 0 ? ring[place - 1] : open ? -1 : ring[size - 1];
    return after == from ? before : after;
  }

  const OrientedCloud& cloud_;
  const LevelRings& rings_;
  const MeshTopology& finest_;
  const LimitSurface& limit_;
  const DisplacementOptions& options_;
};

int NearestCorner(const Eigen::Vector3i& face, const Eigen::Matrix3Xd& positions,
                  const Vector3d& point) {
  return *std::min_element(face.begin(), face.end(), [&](int a, int b) {
    return (positions.col(a) - point).squaredNorm() < (positions.col(b) - point).squaredNorm();
  });
}

// The way from the displaced surface to points.
class PointReacher {
 public:
  PointReacher(const OrientedCloud& cloud, const LoopRefinement& refinement,
               const LimitSurface& limit, const std::vector<float>& heights,
               const std::vector<float>& spacing)
      : cloud_(cloud),
        refinement_(refinement),
        limit_(limit),
        heights_(heights),
        spacing_(spacing) {}

  // `face` of level SearchLevel: the nearest to the point. Not found where the point is not to be
  // reached.
  PointFoot Reach(int64_t p, int face) const {
    const Vector3d point = cloud_.points.col(p);
    const Way way = NearestChild(point, face);
    const double length = way.off.norm();
    // The spacing at the surface: an outlier's own is large.
    const double most =
        kFeet.farthest_way * std::max<double>(spacing_[way.corner[0]], cloud_.median_spacing);
    if (!(length > 0) || length > most || EndsOnRim(way)) return PointFoot();
    PointFoot foot;
    foot.corner = way.corner;
    Vector3d mean = Vector3d::Zero();
    double offset = length;
    for (int k = 0; k < 3; ++k) {
      const int v = way.corner[k];
      mean += way.weight[k] * limit_.normals.col(v);
      foot.weight[k] =
          static_cast<float>(way.weight[k] * limit_.normals.col(v).dot(way.off) / length);
      offset += foot.weight[k] * heights_[v];
    }
    foot.offset = static_cast<float>(offset);
    const bool beside = std::abs(mean.dot(way.off)) < kFeet.along_way * length;
    return mean.dot(cloud_.normals.col(p)) > 0 && !beside ? foot : PointFoot();
  }

  Vector3d PlaceOf(int v) const {
    return limit_.positions.col(v) + heights_[v] * limit_.normals.col(v);
  }

 private:
  struct Way {
    Corners corner;
    Vector3d weight;  // of the corners, where it starts
    Vector3d off;     // from there to the point
  };

  // From the nearest of the triangles of the finest level that the face became.
  Way NearestChild(const Vector3d& point, int face) const {
    const int level = SearchLevel(refinement_);
    const MeshTopology& coarse = refinement_.levels[level];
    const Corners c = {coarse.faces(0, face), coarse.faces(1, face), coarse.faces(2, face)};
    if (level == refinement_.max_level()) return WayFrom(c, point);
    Corners m;
    for (int k = 0; k < 3; ++k) m[k] = coarse.vertex_count + coarse.face_edges(k, face);
    Way nearest = WayFrom({m[1], m[2], m[0]}, point);
    for (const Corners& child :
         {Corners{c[0], m[0], m[2]}, Corners{m[0], c[1], m[1]}, Corners{m[2], m[1], c[2]}}) {
      const Way way = WayFrom(child, point);
      if (way.off.squaredNorm() < nearest.off.squaredNorm()) nearest = way;
    }
    return nearest;
  }

  Way WayFrom(const Corners& corner, const Vector3d& point) const {
    const Vector3d a = PlaceOf(corner[0]), b = PlaceOf(corner[1]), c = PlaceOf(corner[2]);
    const Vector3d w = ClosestWeights(point, a, b, c);
    return {corner, w, point - w[0] * a - w[1] * b - w[2] * c};
  }

  // Points beyond a rim say nothing about its heights.
  bool EndsOnRim(const Way& way) const {
    const MeshTopology& finest = refinement_.levels.back();
    if (way.weight.minCoeff() > 0) return false;
    for (int k = 0; k < 3; ++k) {
      if (way.weight[k] > 0 && !finest.boundary_vertex[way.corner[k]]) return false;
    }
    return true;
  }

  const OrientedCloud& cloud_;
  const LoopRefinement& refinement_;
  const LimitSurface& limit_;
  const std::vector<float>& heights_;
  const std::vector<float>& spacing_;
};

}  // namespace

absl::StatusOr<std::vector<PointFoot>> FindFeet(const OrientedCloud& cloud,
                                                const LoopRefinement& refinement,
                                                const LevelRings& rings, const LimitSurface& limit,
                                                const DisplacementOptions& options,
                                                const RunContext& context) {
  const MeshTopology& coarse = refinement.levels[SearchLevel(refinement)];
  const Eigen::Matrix3Xd places = limit.positions.leftCols(coarse.vertex_count);
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree, SearchTree(refinement, places, context));
  const FootFinder finder(cloud, rings, refinement.levels.back(), limit, options);
  const auto start_at = [&](int item, const Vector3d& point) {
    return NearestCorner(coarse.faces.col(tree.source()[item]), places, point);
  };
  const double farthest2 = options.max_height * options.max_height;
  std::vector<PointFoot> feet(cloud.points.cols());
  RILIEVO_RETURN_IF_ERROR(ParallelFor(
      static_cast<int64_t>(feet.size()), kLightBlock, context, [&](int64_t begin, int64_t end) {
        int hint = -1;
        for (int64_t p = begin; p < end; ++p) {
          const Vector3d point = cloud.points.col(p);
          hint = tree.Closest(point, hint).item;
          std::optional<PointFoot> foot = finder.Walk(p, start_at(hint, point));
          if (!foot) {
            // Nearer to another sheet, or to where the normals part.
            std::array<ClosestPointTree::Hit, kFeet.tries> hits;
            const int found = tree.Nearest(point, hits);
            for (int i = 1; i < found && !foot && hits[i].squared_distance <= farthest2; ++i) {
              const int start = start_at(hits[i].item, point);
              if (limit.normals.col(start).dot(cloud.normals.col(p)) >
                  options.min_normal_agreement) {
                foot = finder.Walk(p, start);
              }
            }
          }
          if (foot) feet[p] = *foot;
        }
      }));
  return feet;
}

absl::Status ReachPoints(const OrientedCloud& cloud, const LoopRefinement& refinement,
                         const LimitSurface& limit, const std::vector<float>& heights,
                         const std::vector<float>& spacing, const RunContext& context,
                         std::vector<PointFoot>* feet) {
  const PointReacher reacher(cloud, refinement, limit, heights, spacing);
  Eigen::Matrix3Xd places(3, refinement.levels[SearchLevel(refinement)].vertex_count);
  for (int v = 0; v < places.cols(); ++v) places.col(v) = reacher.PlaceOf(v);
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree, SearchTree(refinement, places, context));
  return ParallelForEach(static_cast<int64_t>(feet->size()), kLightBlock, context, [&](int64_t p) {
    if ((*feet)[p].found()) return;
    const int item = tree.Closest(cloud.points.col(p)).item;
    (*feet)[p] = reacher.Reach(p, tree.source()[item]);
  });
}

}  // namespace rilievo
