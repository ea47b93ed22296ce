// An unorganized point cloud as a plain value.
#pragma once

#include <Eigen/Core>

#include "core/geometry/point_sights.h"

namespace rilievo {

struct PointCloud {
  // Column = point, scan frame (the scanner's own coordinates and unit), double so that map-grid
  // offsets lose nothing. May hold non-finite values until CheckScan has seen it.
  Eigen::Matrix3Xd points;
  // What is known of them besides, in the same frame.
  PointSights sights = {};
};

}  // namespace rilievo
