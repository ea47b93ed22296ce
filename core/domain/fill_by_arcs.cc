#include "core/domain/fill_by_arcs.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/status_macros.h"
#include "core/domain/settings.h"
#include "core/geometry/connected_parts.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_ring.h"
#include "core/loop/refinement.h"
#include "core/points/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// How far along `normal` from `place` an arc from a point with a normal passes.
double ArcHeight(const Vector3d& place, const Vector3d& normal, const Vector3d& point,
                 const Vector3d& point_normal) {
  return (point - place).dot(normal + point_normal) / std::max(1 + normal.dot(point_normal), 0.1);
}

// The surface of the points near `place`: the normal that is linear over them, and the place that
// arcs from them come to.
void SettleAtPoints(const OrientedCloud& cloud, const PointIndex& index, Vector3d* place,
                    Vector3d* normal) {
  int found[kCommon.points_by_border];
  double squared[kCommon.points_by_border];
  const int count =
      index.Nearest(*place, std::min(kCommon.points_by_border, index.size()), found, squared);
  Vector3d mean = Vector3d::Zero();
  for (int k = 0; k < count; ++k) mean += cloud.normals.col(found[k]);
  const Vector3d x = mean.unitOrthogonal(), y = mean.normalized().cross(x);
  Eigen::Matrix<double, Eigen::Dynamic, 3> rows(count, 3), normals(count, 3);
  for (int k = 0; k < count; ++k) {
    const Vector3d way = cloud.points.col(found[k]) - *place;
    rows.row(k) << 1, way.dot(x), way.dot(y);
    normals.row(k) = cloud.normals.col(found[k]).transpose();
  }
  const Eigen::Matrix3d fit = rows.colPivHouseholderQr().solve(normals);
  *normal = fit.row(0).transpose().normalized();
  double height = 0;
  for (int k = 0; k < count; ++k) {
    height += ArcHeight(*place, *normal, cloud.points.col(found[k]), cloud.normals.col(found[k]));
  }
  *place += height / count * *normal;
}

// Parts that reach the boundary are none: no rim goes all around them.
void DropOpenParts(const MeshTopology& topology, const VertexRings& rings,
                   std::vector<uint8_t>* is_empty) {
  std::vector<int> waiting;
  const auto drop = [&](int v) {
    if ((*is_empty)[v] == 0) return;
    (*is_empty)[v] = 0;
    waiting.push_back(v);
  };
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (topology.boundary_vertex[v] != 0) drop(v);
  }
  while (!waiting.empty()) {
    const int v = waiting.back();
    waiting.pop_back();
    for (const int other : RingOf(rings, v)) drop(other);
  }
}

// In the order in which they are met from the rim inwards.
std::vector<int> FromRimInwards(const VertexRings& rings, const std::vector<uint8_t>& is_empty) {
  std::vector<uint8_t> seen(is_empty.size(), 0);
  std::vector<int> order;
  const auto visit_around = [&](int v) {
    for (const int other : RingOf(rings, v)) {
      if (is_empty[other] == 0 || seen[other] != 0) continue;
      seen[other] = 1;
      order.push_back(other);
    }
  };
  for (int v = 0; v < static_cast<int>(is_empty.size()); ++v) {
    if (is_empty[v] == 0) visit_around(v);
  }
  for (size_t next = 0; next < order.size(); ++next) visit_around(order[next]);
  return order;
}

class ArcRelaxation {
 public:
  ArcRelaxation(const VertexRings& rings, Eigen::Matrix3Xd* places, Eigen::Matrix3Xd* normals)
      : rings_(rings), places_(*places), normals_(*normals) {}

  // Normals are zero where not known yet. Returns how far the vertex moved.
  double Relax(int v, double over) {
    Vector3d middle = Vector3d::Zero(), normal = Vector3d::Zero();
    int known = 0;
    ForEachKnown(v, [&](int other) {
      middle += places_.col(other);
      normal += normals_.col(other);
      ++known;
    });
    if (known == 0 || normal.isZero()) return 0;
    middle /= known;
    normal.normalize();
    double height = 0;
    ForEachKnown(v, [&](int other) {
      height += ArcHeight(middle, normal, places_.col(other), normals_.col(other));
    });
    const Vector3d place = middle + height / known * normal;
    const bool is_first = normals_.col(v).isZero();
    const Vector3d move = (is_first ? 1 : over) * (place - places_.col(v));
    places_.col(v) += move;
    normals_.col(v) =
        is_first ? normal : (normals_.col(v) + over * (normal - normals_.col(v))).normalized();
    return move.norm();
  }

 private:
  template <typename Visit>
  void ForEachKnown(int v, const Visit& visit) const {
    for (const int other : RingOf(rings_, v)) {
      if (!normals_.col(other).isZero()) visit(other);
    }
  }

  const VertexRings& rings_;
  Eigen::Matrix3Xd& places_;
  Eigen::Matrix3Xd& normals_;
};

absl::StatusOr<std::vector<uint8_t>> FindEmpty(const OrientedCloud& cloud, const PointIndex& index,
                                               const LimitSurface& limit,
                                               const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> nearest,
                           index.NearestOfEach(limit.positions, context));
  std::vector<uint8_t> is_empty(nearest.size(), 0);
  for (size_t v = 0; v < nearest.size(); ++v) {
    const int point = nearest[v];
    const Vector3d normal = limit.normals.col(static_cast<int64_t>(v));
    const Vector3d way = cloud.points.col(point) - limit.positions.col(static_cast<int64_t>(v));
    const double beside = (way - way.dot(normal) * normal).norm();
    is_empty[v] = beside > kFillByArcs.near_spacings * cloud.spacing[point] +
                               kFillByArcs.near_noises * cloud.noise[point];
  }
  return is_empty;
}

// 1 at the marked vertices and so many rings around.
std::vector<uint8_t> WithRings(const VertexRings& rings, std::vector<uint8_t> marked, int count) {
  for (; count > 0; --count) {
    std::vector<uint8_t> wider = marked;
    for (size_t v = 0; v < marked.size(); ++v) {
      for (const int other : RingOf(rings, static_cast<int>(v))) wider[v] |= marked[other];
    }
    marked = std::move(wider);
  }
  return marked;
}

// By part, the integral of the squared change of curvature along the edges: between two points it
// is twice what their normals fall short of an arc, over the squared distance.
std::vector<double> CurvatureVariation(const VertexRings& rings, const LimitSurface& limit,
                                       const std::vector<int>& part, int parts) {
  std::vector<double> variation(static_cast<size_t>(parts), 0);
  for (size_t v = 0; v < part.size(); ++v) {
    if (part[v] < 0) continue;
    const auto i = static_cast<int64_t>(v);
    for (const int j : RingOf(rings, static_cast<int>(v))) {
      const Vector3d way = limit.positions.col(j) - limit.positions.col(i);
      const double change = way.dot(limit.normals.col(i) + limit.normals.col(j)) /
                            std::max(way.squaredNorm(), 1e-300);
      variation[part[v]] += change * change;
    }
  }
  return variation;
}

}  // namespace

absl::StatusOr<bool> FillByArcs(const OrientedCloud& cloud, const PointIndex& index,
                                const RunContext& context, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const LoopRefinement refinement, RefineTopology(*mesh, 0, context));
  RILIEVO_ASSIGN_OR_RETURN(LimitSurface limit,
                           EvaluateLimit(refinement, mesh->vertices, 0, context));
  RILIEVO_ASSIGN_OR_RETURN(std::vector<uint8_t> is_empty, FindEmpty(cloud, index, limit, context));
  const VertexRings rings = BuildVertexRings(refinement.levels.front());
  DropOpenParts(refinement.levels.front(), rings, &is_empty);
  const std::vector<int> order = FromRimInwards(rings, is_empty);
  if (order.empty()) return false;
  Eigen::Matrix3Xd places = limit.positions;
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, places.cols());
  const std::vector<uint8_t> with_rim = WithRings(rings, is_empty, 1);
  for (int v = 0; v < places.cols(); ++v) {
    if (with_rim[v] == is_empty[v]) continue;
    Vector3d place = places.col(v), normal;
    SettleAtPoints(cloud, index, &place, &normal);
    places.col(v) = place;
    normals.col(v) = normal;
  }
  ArcRelaxation relaxation(rings, &places, &normals);
  for (int sweep = 0; sweep < kFillByArcs.most_sweeps; ++sweep) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    double farthest = 0;
    for (const int v : order) farthest = std::max(farthest, relaxation.Relax(v, kFillByArcs.over));
    if (sweep > 0 && farthest < kFillByArcs.rest) break;
  }
  const std::vector<uint8_t> band = WithRings(rings, is_empty, kFillByArcs.band_rings);
  int parts = 0;
  const std::vector<int> part = ConnectedParts(
      band, [&](int v) { return RingOf(rings, v); }, &parts);
  const std::vector<double> before = CurvatureVariation(rings, limit, part, parts);
  const Eigen::Matrix3Xd fitted = mesh->vertices;
  for (int round = 0; round < kFillByArcs.limit_rounds; ++round) {
    for (int v = 0; v < places.cols(); ++v) {
      if (band[v] != 0) mesh->vertices.col(v) += places.col(v) - limit.positions.col(v);
    }
    RILIEVO_ASSIGN_OR_RETURN(limit, EvaluateLimit(refinement, mesh->vertices, 0, context));
  }
  const std::vector<double> after = CurvatureVariation(rings, limit, part, parts);
  std::vector<uint8_t> is_better(before.size());
  for (size_t i = 0; i < before.size(); ++i) is_better[i] = after[i] < before[i];
  for (const Crease& crease : mesh->creases) {  // which arcs would round off
    for (const int end : {crease.a, crease.b}) {
      if (with_rim[end] != 0) is_better[part[end]] = 0;
    }
  }
  bool is_filled = false;
  for (int v = 0; v < places.cols(); ++v) {
    if (band[v] == 0) continue;
    if (is_better[part[v]] == 0) mesh->vertices.col(v) = fitted.col(v);
    is_filled = is_filled || is_better[part[v]] != 0;
  }
  return is_filled;
}

}  // namespace rilievo
