#include "core/points/point_support.h"

#include <algorithm>
#include <cmath>

namespace rilievo {

double SupportReach(const OrientedCloud& cloud, int point) {
  constexpr double kSpacings = 1.6, kNoises = 4;
  return std::max<double>(kSpacings * cloud.spacing[point], kNoises * cloud.noise[point]);
}

bool HasSupport(const OrientedCloud& cloud, const PointIndex& index, const Eigen::Vector3d& place) {
  int nearest = 0;
  double square = 0;
  index.Nearest(place, 1, &nearest, &square);
  return std::sqrt(square) <= SupportReach(cloud, nearest);
}

}  // namespace rilievo
