// Which cubes of a lattice a triangle meets.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// How far, in edges of a cube, a triangle may miss a cube that counts as met. It covers rounding,
// so that no cube that is met is left out.
inline constexpr double kVoxelSlack = 0x1p-30;

// Separating axes of a triangle and a cube of edge length 1 (T. Akenine-Moeller, "Fast 3D
// triangle-box overlap testing", J. Graphics Tools 6(1), 2001), prepared for many cubes. Of the 13
// axes those three along the cube's edges are the caller's: it asks only cubes that meet the
// bounding box. Degenerate triangles are segments and points.
class TriangleBoxTest {
 public:
  TriangleBoxTest(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

  // Whether no other axis separates the triangle from the cube around `center`.
  bool Meets(double x, double y, double z) const {
    const double along = plane_[0] * x + plane_[1] * y + plane_[2] * z;
    if (along < plane_low_ || along > plane_high_) return false;
    bool apart = false;
    for (int k = 0; k < 9; ++k) {
      const double at = axis_x_[k] * x + axis_y_[k] * y + axis_z_[k] * z;
      apart |= (at < low_[k]) | (at > high_[k]);
    }
    return !apart;
  }

 private:
  double plane_[3], plane_low_, plane_high_;
  double axis_x_[9], axis_y_[9], axis_z_[9], low_[9], high_[9];
};

}  // namespace rilievo
