#include "core/surface/triangle_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Squared sine of a corner below which rounding hides on which side of an edge a point lies; then
// the triangle is as good as its edges.
constexpr double kSliver = 1e-12;

// Of the place nearest to `point`, from a to b.
double ShareOfSegment(const Vector3d& point, const Vector3d& a, const Vector3d& b) {
  const Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  return length2 > 0 ? std::clamp(ab.dot(point - a) / length2, 0.0, 1.0) : 0.0;
}

double SquaredDistanceToSegment(const Vector3d& point, const Vector3d& a, const Vector3d& b) {
  return (point - a - ShareOfSegment(point, a, b) * (b - a)).squaredNorm();
}

}  // namespace

double SquaredDistanceToTriangle(const Vector3d& point, const Vector3d& a, const Vector3d& b,
                                 const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, ap = point - a;
  const double ab2 = ab.squaredNorm(), ac2 = ac.squaredNorm(), ab_ac = ab.dot(ac);
  if (!(ab2 * ac2 - ab_ac * ab_ac > kSliver * ab2 * ac2)) {
    return std::min({SquaredDistanceToSegment(point, a, b), SquaredDistanceToSegment(point, b, c),
                     SquaredDistanceToSegment(point, c, a)});
  }
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return ap.squaredNorm();
  const Vector3d bp = point - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return bp.squaredNorm();
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    return d1 == d3 ? ap.squaredNorm() : (ap - d1 / (d1 - d3) * ab).squaredNorm();
  }
  const Vector3d cp = point - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return cp.squaredNorm();
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    return d2 == d6 ? ap.squaredNorm() : (ap - d2 / (d2 - d6) * ac).squaredNorm();
  }
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double sum = (d4 - d3) + (d5 - d6);
    return sum == 0 ? bp.squaredNorm() : (bp - (d4 - d3) / sum * (c - b)).squaredNorm();
  }
  const double sum = va + vb + vc;
  if (sum == 0) return ap.squaredNorm();
  return (ap - vb / sum * ab - vc / sum * ac).squaredNorm();
}

Vector3d ClosestWeights(const Vector3d& point, const Vector3d& a, const Vector3d& b,
                        const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, ap = point - a, cross = ab.cross(ac);
  const double cross2 = cross.squaredNorm();
  if (cross2 > kSliver * ab.squaredNorm() * ac.squaredNorm()) {
    const double at_b = ap.cross(ac).dot(cross) / cross2, at_c = ab.cross(ap).dot(cross) / cross2;
    if (at_b >= 0 && at_c >= 0 && at_b + at_c <= 1) {
      return {std::max(0.0, 1 - at_b - at_c), at_b, at_c};
    }
  }
  const std::array<Vector3d, 3> corners = {a, b, c};
  Vector3d best = Vector3d::UnitX();
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vector3d &from = corners[k], &to = corners[(k + 1) % 3];
    const double share = ShareOfSegment(point, from, to);
    const double squared = (point - from - share * (to - from)).squaredNorm();
    if (!(squared < least)) continue;
    least = squared;
    best.setZero();
    best[k] = 1 - share;
    best[(k + 1) % 3] = share;
  }
  return best;
}

}  // namespace rilievo
