#include "core/evaluate/surface_jet.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/loop/limit_normal.h"

namespace rilievo {

Eigen::Vector3d NormalOf(const SurfaceJet& jet) {
  Eigen::Vector3d normal;
  if (!NormalFromTangents(jet.u, jet.v, 0.0, normal)) return Eigen::Vector3d::Zero();
  return normal;
}

// The eigenvalues of the shape operator, from the first and second fundamental forms (do Carmo,
// Differential Geometry of Curves and Surfaces, 3.3).
SurfaceShape ShapeOf(const SurfaceJet& jet) {
  SurfaceShape shape;
  shape.normal = NormalOf(jet);
  shape.least_curvature = shape.greatest_curvature = std::numeric_limits<double>::quiet_NaN();
  const double e = jet.u.squaredNorm(), f = jet.u.dot(jet.v), g = jet.v.squaredNorm();
  const double area = e * g - f * f;
  if (jet.irregular || shape.normal.isZero() || !(area > 0)) return shape;
  const double l = -shape.normal.dot(jet.uu), m = -shape.normal.dot(jet.uv),
               n = -shape.normal.dot(jet.vv);
  const double mean = (e * n - 2 * f * m + g * l) / (2 * area);
  const double gauss = (l * n - m * m) / area;
  const double half_difference = std::sqrt(std::max(0.0, mean * mean - gauss));
  shape.least_curvature = mean - half_difference;
  shape.greatest_curvature = mean + half_difference;
  return shape;
}

}  // namespace rilievo
