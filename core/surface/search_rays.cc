#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/surface/closest_point_tree.h"

namespace rilievo {

using Eigen::Vector3d;

namespace {

// A ray in coordinates where it runs along z: triangles are cut in the plane of x and y, so that
// two that share an edge agree on which of them is met (Woop, Benthin, Wald 2013).
class ShearedRay {
 public:
  ShearedRay(const Vector3d& origin, const Vector3d& direction) : origin_(origin) {
    direction.cwiseAbs().maxCoeff(&z_);
    x_ = (z_ + 1) % 3;
    y_ = (z_ + 2) % 3;
    if (direction[z_] < 0) std::swap(x_, y_);
    shear_ = Vector3d(direction[x_], direction[y_], 1) / direction[z_];
  }

  // Where the triangle is met, in lengths of the direction; its weights then sum to one. False
  // where it is missed or seen edge-on.
  bool Meets(const Vector3d& a, const Vector3d& b, const Vector3d& c, double* at, bool* from_behind,
             Vector3d* weights) const {
    const Vector3d p = Sheared(a), q = Sheared(b), r = Sheared(c);
    const double u = r[0] * q[1] - r[1] * q[0], v = p[0] * r[1] - p[1] * r[0],
                 w = q[0] * p[1] - q[1] * p[0];
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return false;
    const double sum = u + v + w;
    if (sum == 0) return false;
    *weights = Vector3d(u, v, w) / sum;
    *at = (u * p[2] + v * q[2] + w * r[2]) / sum;
    *from_behind = sum < 0;
    return true;
  }

 private:
  Vector3d Sheared(const Vector3d& point) const {
    const Vector3d local = point - origin_;
    return {local[x_] - shear_[0] * local[z_], local[y_] - shear_[1] * local[z_],
            shear_[2] * local[z_]};
  }

  Vector3d origin_;
  int x_ = 0, y_ = 0, z_ = 0;
  Vector3d shear_;
};

// Whether the ray meets a box grown by what its float corners may be off.
bool MeetsBox(const Vector3d& origin, const Vector3d& direction, const Vector3d& low,
              const Vector3d& high) {
  double enter = 0, leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double slack = 1e-12 * (1 + std::abs(origin[axis]));
    if (direction[axis] == 0) {
      if (origin[axis] < low[axis] - slack || origin[axis] > high[axis] + slack) return false;
      continue;
    }
    double first = (low[axis] - slack - origin[axis]) / direction[axis];
    double second = (high[axis] + slack - origin[axis]) / direction[axis];
    if (first > second) std::swap(first, second);
    enter = std::max(enter, first);
    leave = std::min(leave, second);
  }
  return enter <= leave * (1 + 1e-12);
}

}  // namespace

std::vector<ClosestPointTree::RayHit> ClosestPointTree::AlongRay(const Vector3d& from,
                                                                 const Vector3d& direction) const {
  std::vector<RayHit> hits;
  if (points_ || direction.isZero()) return hits;
  const Vector3d local = from - origin_;
  const ShearedRay ray(local, direction);
  // Boxes are scaled.
  const Vector3d scaled = box_scale_ * local, heading = box_scale_ * direction;
  std::vector<int32_t> stack = {0};
  while (!stack.empty()) {
    const Node& node = nodes_[stack.back()];
    stack.pop_back();
    for (int k = 0; k < kWidth; ++k) {
      Vector3d low, high;
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = node.boxes.lo[axis][k];
        high[axis] = node.boxes.hi[axis][k];
      }
      if (low[0] > high[0] || !MeetsBox(scaled, heading, low, high)) continue;
      if (node.child[k] >= 0) {
        stack.push_back(node.child[k]);
        continue;
      }
      const Run run = RunOf(node.child[k]);
      for (int item = run.first; item < run.first + run.count; ++item) {
        RayHit hit{0, items_[item], false, Vector3d::Zero()};
        if (ray.Meets(CornerOf(item, 0), CornerOf(item, 1), CornerOf(item, 2), &hit.at,
                      &hit.from_behind, &hit.weights) &&
            hit.at >= 0) {
          hits.push_back(hit);
        }
      }
    }
  }
  std::sort(hits.begin(), hits.end(), [](const RayHit& a, const RayHit& b) {
    return a.at != b.at ? a.at < b.at : a.triangle < b.triangle;
  });
  // Met in an edge or vertex, the surface is met once.
  const double same = 1e-12 / (box_scale_ * direction.norm());
  const auto repeats = [&](const RayHit& a, const RayHit& b) {
    return b.at - a.at <= same && a.from_behind == b.from_behind;
  };
  hits.erase(std::unique(hits.begin(), hits.end(), repeats), hits.end());
  return hits;
}

}  // namespace rilievo
