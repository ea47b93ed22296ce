#include "tests/scans/ray_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kLeaf = 4;

// Distance to the triangle along the ray; infinity where it is missed.
double Meet(const Ray& ray, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const Vector3d ab = b - a, ac = c - a;
  const Vector3d p = ray.direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0) return kNone;
  const Vector3d from_a = ray.origin - a;
  const double u = from_a.dot(p) / determinant;
  if (u < 0 || u > 1) return kNone;
  const Vector3d q = from_a.cross(ab);
  const double v = ray.direction.dot(q) / determinant;
  if (v < 0 || u + v > 1) return kNone;
  const double distance = ac.dot(q) / determinant;
  return distance > 0 ? distance : kNone;
}

// Where the ray enters the box; infinity where it does not before `end`.
double Enter(const Eigen::AlignedBox3d& box, const Vector3d& origin, const Vector3d& inverse,
             double end) {
  const Eigen::Array3d low = (box.min() - origin).array() * inverse.array();
  const Eigen::Array3d high = (box.max() - origin).array() * inverse.array();
  const double enter = std::max(0.0, low.min(high).maxCoeff());
  const double leave = std::min(end, low.max(high).minCoeff());
  return enter <= leave ? enter : std::numeric_limits<double>::infinity();
}

}  // namespace

RayTree::RayTree(const TriangleMesh& mesh)
    : mesh_(mesh), centers_(3, mesh.triangles.cols()), order_(mesh.triangles.cols()) {
  for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
    centers_.col(f) = mesh.vertices(Eigen::all, mesh.triangles.col(f)).rowwise().mean();
  }
  std::iota(order_.begin(), order_.end(), 0);
  Build(0, static_cast<int>(order_.size()));
}

void RayTree::Build(int begin, int end) {
  const size_t index = nodes_.size();
  Node node;
  node.begin = begin;
  node.end = end;
  Eigen::AlignedBox3d centers;
  for (int i = begin; i < end; ++i) {
    for (const int v : mesh_.triangles.col(order_[i])) node.box.extend(mesh_.vertices.col(v));
    centers.extend(centers_.col(order_[i]));
  }
  // Faces lie along the axes: rounding must not lose them.
  const Vector3d margin = Vector3d::Constant(1e-9 * (1 + node.box.max().cwiseAbs().maxCoeff()));
  node.box.min() -= margin;
  node.box.max() += margin;
  nodes_.push_back(node);
  if (end - begin <= kLeaf) return;
  int axis = 0;
  centers.sizes().maxCoeff(&axis);
  const int middle = (begin + end) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](int a, int b) { return centers_(axis, a) < centers_(axis, b); });
  Build(begin, middle);
  nodes_[index].second = static_cast<int>(nodes_.size());
  Build(middle, end);
}

std::optional<RayTree::Hit> RayTree::First(const Ray& ray) const {
  const Vector3d inverse = ray.direction.cwiseInverse();
  Hit hit{std::numeric_limits<double>::infinity(), -1};
  std::vector<int> stack{0};
  while (!stack.empty()) {
    const int index = stack.back();
    stack.pop_back();
    const Node& node = nodes_[index];
    if (Enter(node.box, ray.origin, inverse, hit.distance) >= hit.distance) continue;
    if (node.second > 0) {
      const int first = index + 1;
      const bool swap = Enter(nodes_[first].box, ray.origin, inverse, hit.distance) >
                        Enter(nodes_[node.second].box, ray.origin, inverse, hit.distance);
      stack.push_back(swap ? first : node.second);
      stack.push_back(swap ? node.second : first);
      continue;
    }
    for (int i = node.begin; i < node.end; ++i) {
      const auto corners = mesh_.triangles.col(order_[i]);
      const double distance = Meet(ray, mesh_.vertices.col(corners[0]),
                                   mesh_.vertices.col(corners[1]), mesh_.vertices.col(corners[2]));
      if (distance < hit.distance) hit = {distance, order_[i]};
    }
  }
  if (hit.triangle < 0) return std::nullopt;
  return hit;
}

}  // namespace rilievo
