// A scan of few points that falls into several parts all the same.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace rilievo {

// A wavy strip twenty times as long as wide, along the diagonal of its box: there the Morton curve
// follows it, and each page has two neighbours. Column = point.
inline Eigen::Matrix3Xd LongStrip(int points) {
  const Eigen::Vector3d along = Eigen::Vector3d(1, 1, 1).normalized();
  const Eigen::Vector3d across = Eigen::Vector3d(1, -1, 0).normalized();
  const Eigen::Vector3d up = along.cross(across);
  Eigen::Matrix3Xd strip(3, points);
  // The additive sequence of the plastic number, which leaves no gaps.
  double u = 0, v = 0;
  for (int i = 0; i < points; ++i) {
    u = std::fmod(u + 0.754877666246693, 1.0);
    v = std::fmod(v + 0.569840290998053, 1.0);
    const double x = 20 * u;
    strip.col(i) = x * along + v * across + 0.1 * std::sin(3 * x) * std::cos(2 * v) * up;
  }
  return strip;
}

}  // namespace rilievo
