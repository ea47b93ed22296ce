#include "core/voxels/triangle_box.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace rilievo {

using Eigen::Vector3d;

TriangleBoxTest::TriangleBoxTest(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d corners[3] = {a, b, c};
  const Vector3d sides[3] = {b - a, c - b, a - c};
  // Half of a cube's extent along an axis, and the slack.
  const auto reach = [](const Vector3d& axis) {
    return (0.5 + kVoxelSlack) * axis.cwiseAbs().sum();
  };
  const Vector3d normal = sides[0].cross(sides[1]);
  // The normal of a sliver is rounded; its plane then decides less, its sides more.
  constexpr double kRounded = 0x1p-40;
  const double plane_reach = reach(normal) + kRounded * sides[0].norm() * sides[1].norm();
  Vector3d::Map(plane_) = normal;
  plane_low_ = normal.dot(a) - plane_reach;
  plane_high_ = normal.dot(a) + plane_reach;
  for (int k = 0; k < 9; ++k) {
    const Vector3d axis = Vector3d::Unit(k / 3).cross(sides[k % 3]);
    const double at[3] = {axis.dot(corners[0]), axis.dot(corners[1]), axis.dot(corners[2])};
    axis_x_[k] = axis.x();
    axis_y_[k] = axis.y();
    axis_z_[k] = axis.z();
    low_[k] = std::min({at[0], at[1], at[2]}) - reach(axis);
    high_[k] = std::max({at[0], at[1], at[2]}) + reach(axis);
  }
}

}  // namespace rilievo
