// A unit normal from two tangents, unless they span no plane.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace rilievo {

// Below this sine of the angle between the tangents their product is rounding noise,
inline constexpr double kMinTangentSine = 1e-10;
// and so are tangents shorter than this share of the largest control coordinate.
inline constexpr double kMinTangentRatio = 1e-14;

inline double SquaredTangentNoise(const Eigen::Matrix3Xd& control_points) {
  const double noise = kMinTangentRatio * control_points.cwiseAbs().maxCoeff();
  return noise * noise;
}

// u x v, normalised; false when the tangents span no plane.
inline bool NormalFromTangents(const Eigen::Vector3d& u, const Eigen::Vector3d& v,
                               double squared_noise, Eigen::Vector3d& normal) {
  const Eigen::Vector3d product = u.cross(v);
  const double squared = product.squaredNorm();
  const double squared_u = u.squaredNorm(), squared_v = v.squaredNorm();
  const bool plane = squared > kMinTangentSine * kMinTangentSine * squared_u * squared_v &&
                     squared_u > squared_noise && squared_v > squared_noise;
  if (plane) normal = product * (1.0 / std::sqrt(squared));
  return plane;
}

// Area-weighted normal of the open or closed fan of triangles around a vertex; +z if that too is
// degenerate. `neighbor(i)`: ring of `count` neighbours, counter-clockwise.
template <typename Neighbor>
Eigen::Vector3d FanNormal(const Eigen::Vector3d& center, int count, bool closed,
                          const Neighbor& neighbor) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < (closed ? count : count - 1); ++i) {
    sum += (neighbor(i) - center).cross(neighbor((i + 1) % count) - center);
  }
  const double length = sum.norm();
  return length > 0 ? Eigen::Vector3d(sum / length) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

}  // namespace rilievo
