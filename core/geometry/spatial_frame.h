// The similarity between scan coordinates and the unit frame all stages work in.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// unit = (scan - center) / diagonal. In the unit frame the bounding box of the accepted points is
// centred at the origin and has a diagonal of 1: every length there is a fraction of the diagonal.
struct SpatialFrame {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // scan frame
  double diagonal = 1.0;                             // scan unit, > 0

  Eigen::Vector3d UnitFromScan(const Eigen::Vector3d& scan) const {
    return (scan - center) / diagonal;
  }
  Eigen::Vector3d ScanFromUnit(const Eigen::Vector3d& unit) const {
    return unit * diagonal + center;
  }
};

}  // namespace rilievo
