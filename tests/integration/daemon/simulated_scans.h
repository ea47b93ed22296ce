// Scans of the end-to-end tests.
#pragma once

#include <cmath>
#include <numbers>

#include "core/geometry/point_cloud.h"

namespace rilievo {

// Even points on the unit sphere around `center` (Fibonacci lattice).
inline PointCloud SphereScan(int points, const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) {
  PointCloud scan;
  scan.points.resize(3, points);
  const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));
  for (int i = 0; i < points; ++i) {
    const double z = 1 - (2.0 * i + 1) / points;
    const double radius = std::sqrt(1 - z * z);
    scan.points.col(i) = center + Eigen::Vector3d(radius * std::cos(golden_angle * i),
                                                  radius * std::sin(golden_angle * i), z);
  }
  return scan;
}

}  // namespace rilievo
