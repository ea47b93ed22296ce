#include "core/control/simplify/collapse_guards.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "core/control/simplify/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

double SquaredEdges(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
}

}  // namespace

double Roundness(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& cross) {
  const double edges = SquaredEdges(a, b, c);
  return edges > 0 ? 2 * std::numbers::sqrt3 * cross.norm() / edges : 0;
}

bool KeepsFacesUpright(const Eigen::Matrix3Xd& vertices, const HalfEdgeMesh& mesh, int v,
                       const Vector3d& moved) {
  const Vector3d from = vertices.col(v);
  bool upright = true;
  mesh.ForEachOutgoing(v, [&](int h) {
    const Vector3d b = vertices.col(mesh.To(h));
    const Vector3d c = vertices.col(mesh.From(HalfEdgeMesh::Previous(h)));
    const Vector3d before = (b - from).cross(c - from), after = (b - moved).cross(c - moved);
    upright &= after.dot(before) > kCollapseGuards.least_upright * after.norm() * before.norm();
  });
  return upright;
}

bool CollapseGuards::KeepShape(int a, int b, const Vector3d& position, double roundness) const {
  if (ClearlyKeepShape(a, b, position, roundness) && ClearlyKeepShape(b, a, position, roundness)) {
    return true;
  }
  Worst worst;
  Inspect(a, b, position, &worst);
  if (worst.upright) Inspect(b, a, position, &worst);
  return worst.upright && worst.after >= std::min(roundness, worst.before);
}

bool CollapseGuards::ClearlyKeepShape(int vertex, int other, const Vector3d& position,
                                      double roundness) const {
  const Vector3d& a = positions_[vertex];
  const double least_turn = kCollapseGuards.clearly * least_turn_cosine_ * least_turn_cosine_;
  const double kLeastStep =
      kCollapseGuards.clearly * kCollapseGuards.least_upright * kCollapseGuards.least_upright;
  const double least_roundness = kCollapseGuards.clearly * roundness * roundness;
  bool clear = true;
  mesh_.ForEachOutgoing(vertex, [&](int h) {
    if (!clear) return;
    const int to = mesh_.To(h), apex = mesh_.From(HalfEdgeMesh::Previous(h));
    if (to == other || apex == other) return;
    const Vector3d &b = positions_[to], &c = positions_[apex];
    const Vector3d cross = (b - position).cross(c - position), old_cross = (b - a).cross(c - a);
    const double squared = cross.squaredNorm();
    const double turn = cross.dot(reference_normals_[h / 3].cast<double>());
    const double step = cross.dot(old_cross);
    const double edges = SquaredEdges(position, b, c);
    clear = turn > 0 && turn * turn > least_turn * squared && step > 0 &&
            step * step > kLeastStep * squared * old_cross.squaredNorm() &&
            12 * squared > least_roundness * edges * edges;
  });
  return clear;
}

void CollapseGuards::Inspect(int vertex, int other, const Vector3d& position, Worst* worst) const {
  const Vector3d& a = positions_[vertex];
  mesh_.ForEachOutgoing(vertex, [&](int h) {
    if (!worst->upright) return;
    const int to = mesh_.To(h), apex = mesh_.From(HalfEdgeMesh::Previous(h));
    const Vector3d &b = positions_[to], &c = positions_[apex];
    const Vector3d old_cross = (b - a).cross(c - a);
    const double old_roundness = Roundness(a, b, c, old_cross);
    worst->before = std::min(worst->before, old_roundness);
    if (to == other || apex == other) return;
    const Vector3d cross = (b - position).cross(c - position);
    worst->after = std::min(worst->after, Roundness(position, b, c, cross));
    const double length = cross.norm();
    const bool turned =
        !(cross.dot(reference_normals_[h / 3].cast<double>()) >= least_turn_cosine_ * length);
    const bool jumped =
        old_roundness > kCollapseGuards.sliver_roundness &&
        cross.dot(old_cross) < kCollapseGuards.least_upright * length * old_cross.norm();
    if (turned || jumped) worst->upright = false;
  });
}

}  // namespace rilievo
