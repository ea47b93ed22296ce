#include "core/points/point_support.h"

#include <cmath>

namespace rilievo {

bool HasSupport(const OrientedCloud& cloud, const PointIndex& index, const Eigen::Vector3d& place,
                double spacings) {
  int nearest = 0;
  double square = 0;
  index.Nearest(place, 1, &nearest, &square);
  return std::sqrt(square) < spacings * cloud.spacing[nearest] + cloud.noise[nearest];
}

}  // namespace rilievo
