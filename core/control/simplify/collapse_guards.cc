#include "core/control/simplify/collapse_guards.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Faces flatter than this have no normal to speak of: only their turn in all is checked.
constexpr double kSliverRoundness = 0.02;
// On squares, well above what rounding could hide.
constexpr double kClearly = 1 + 1e-6;

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
    upright &= after.dot(before) > kLeastUpright * after.norm() * before.norm();
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
  const double least_turn = kClearly * least_turn_cosine_ * least_turn_cosine_;
  constexpr double kLeastStep = kClearly * kLeastUpright * kLeastUpright;
  const double least_roundness = kClearly * roundness * roundness;
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
    const bool jumped = old_roundness > kSliverRoundness &&
                        cross.dot(old_cross) < kLeastUpright * length * old_cross.norm();
    if (turned || jumped) worst->upright = false;
  });
}

}  // namespace rilievo
