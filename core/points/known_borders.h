// The borders of a given mesh.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// Lines that the border of a surface is to meet exactly; unit frame.
struct KnownBorders {
  // Columns 2 i and 2 i + 1 are the ends of a segment, in the direction of the faces' half-edges.
  Eigen::Matrix3Xd lines;
  Eigen::Matrix3Xd corners;  // where they turn sharply
  bool any() const { return lines.cols() > 0; }
};

}  // namespace rilievo
