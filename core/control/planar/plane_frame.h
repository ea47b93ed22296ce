// The plane of a cloud, and whether the cloud is a height field over it.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Right-handed coordinates of a plane: (u, v) in it, height along its normal. Unit frame lengths.
struct PlaneFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // columns u, v, normal

  Eigen::Vector3d PlaneFromUnit(const Eigen::Vector3d& unit) const {
    return axes.transpose() * (unit - origin);
  }
  Eigen::Vector3d UnitFromPlane(const Eigen::Vector3d& plane) const {
    return axes * plane + origin;
  }
};

// The area that point i stands for, unit frame; a stray far from all others counts for little more
// than its fellows.
double PointArea(const OrientedCloud& cloud, int i);

// Principal plane of the points, each weighted by its area, its normal on the side of the points'
// normals; or the plane across their mean normal where more of the normals agree with that. u is
// the longer principal axis of the projected points.
PlaneFrame FitPlaneFrame(const OrientedCloud& cloud);

struct HeightFieldCheck {
  double single_sheet = 0;  // share of occupied plane cells whose points lie on one sheet
  double facing = 0;        // share of area whose normal is within 80 degrees of the plane's
  // Walls that a height field would add where the heights of neighbouring cells break and no point
  // lies between: their area over that of the occupied cells.
  double unseen_walls = 0;
};

// Cells are a few median spacings wide; two sheets are a gap in height of several cells.
absl::StatusOr<HeightFieldCheck> CheckHeightField(const OrientedCloud& cloud,
                                                  const PlaneFrame& frame,
                                                  const RunContext& context);

}  // namespace rilievo
