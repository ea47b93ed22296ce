// The similarity between scan coordinates and the unit frame all stages work in.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"

namespace rilievo {

// unit = (scan - center) / diagonal. In the unit frame the bounding box of the accepted points has
// a diagonal of 1 and its centre at the origin: every length there is a fraction of the diagonal. A
// surface's frame is rounded, since files carry it: to a millionth, the centre to a thousandth.
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

// The unit frame of `inner` as one within that of `outer`: its ScanFromUnit carries from the unit
// frame of `inner` to that of `outer`.
inline SpatialFrame Between(const SpatialFrame& inner, const SpatialFrame& outer) {
  return {outer.UnitFromScan(inner.center), inner.diagonal / outer.diagonal};
}

// That of the bounding box of some points, finite ones. INVALID_ARGUMENT when they are all at one
// place or too far out for the frame of a surface (kMostFrameLength).
absl::StatusOr<SpatialFrame> BoundingFrame(const Eigen::Matrix3Xd& points,
                                           const std::vector<int>& columns);

// Nearly the same frame in few digits, so that a file's takes 15 bytes and not 32: the diagonal
// keeps 20 binary digits after the first, the centre lies on a grid of 2^-10 to 2^-11 of it.
SpatialFrame Rounded(const SpatialFrame& frame);

}  // namespace rilievo
