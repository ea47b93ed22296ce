// The views of a simulated scan as scans of their own, each a little off its place.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/geometry/point_cloud.h"
#include "tests/scans/scanner.h"

namespace rilievo {

struct Displacement {
  double degrees = 0;  // of the turn about the middle of the scan, whose axis is random
  double share = 0;    // length of the move, in a random direction, fraction of the diagonal
  uint64_t seed = 1;
};

struct DisplacedView {
  PointCloud cloud;         // the points of one viewpoint, with that for their station
  Eigen::Isometry3d moved;  // cloud = moved * what was seen
};

// One for each viewpoint, in their order; the first stays in its place. Outliers are left out.
std::vector<DisplacedView> DisplaceViews(const SimulatedScan& scan,
                                         const Displacement& displacement);

}  // namespace rilievo
