// A point of a parametric surface with its derivatives, and what they say of its shape.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// Up to which derivatives a point is evaluated.
enum class JetOrder { kPosition = 0, kFirst = 1, kSecond = 2 };

// On a face with corners 0, 1, 2 the parameters (u, v) weigh corner 1 by u, corner 2 by v and
// corner 0 by 1 - u - v. Derivatives beyond the order asked for are not set.
struct SurfaceJet {
  Eigen::Vector3d position;
  Eigen::Vector3d u, v;
  Eigen::Vector3d uu, uv, vv;
  // An irregular vertex: the limit surface has no derivatives in (u, v) there. Then `u` and `v`
  // span its tangent plane, u x v outward, and the second derivatives are not a number.
  bool irregular = false;
};

// Principal curvatures: positive where the surface bends away from its normal, 1 / r on a sphere
// with outward normals.
struct SurfaceShape {
  Eigen::Vector3d normal;  // unit, outward; zero where the tangents span no plane
  double least_curvature, greatest_curvature;  // NaN where there are none
};
SurfaceShape ShapeOf(const SurfaceJet& jet);  // of order kSecond

// The unit normal alone; of order kFirst or higher.
Eigen::Vector3d NormalOf(const SurfaceJet& jet);

}  // namespace rilievo
