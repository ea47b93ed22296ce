// An unorganized point cloud, or a triangle mesh, as a plain value.
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
  // Of a mesh whose vertices are the points: column = triangle, the indices of its corners,
  // counter-clockwise seen from outside. Without columns: a scan.
  Eigen::Matrix3Xi triangles = {};
};

}  // namespace rilievo
