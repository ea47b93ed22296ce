// The part of a plane between loops, cut into triangles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

namespace rilievo {

struct CutTriangle {
  std::array<int, 3> corners;  // indices of `points`
  // By half-edge from corner k to corner k + 1: the diagonal that it is, which two triangles have,
  // or -1 on a loop.
  std::array<int, 3> diagonals;
};

// `loops`: indices of `points`, at least three each, with the part on their left; those that run
// clockwise are holes of the others. All half-edges of the loops are those of exactly one triangle
// each, whatever rounding has made of the points; triangles are counter-clockwise but where the
// loops touch or cross. Diagonals are numbered from 0.
std::vector<CutTriangle> CutLoops(const Eigen::Matrix2Xd& points,
                                  const std::vector<std::vector<int>>& loops);

}  // namespace rilievo
