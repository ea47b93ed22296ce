// Triangles of a cut face made well shaped.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/booleans/cut_loops.h"

namespace rilievo {

// Diagonals are flipped until they are Delaunay's. Where `add_points`, triangles that are large
// beside the loop edges near them get a point in the middle, which becomes a corner of three: so
// long thin fans become triangles that grow with the distance from a fine loop (P. Liepa, "Filling
// Holes in Meshes", 2003, section 4).
// `points`: of the corners, in a plane. Returns by added point the three corners that it is the
// mean of; it is corner points.cols() + i.
std::vector<std::array<int, 3>> RefineCut(const Eigen::Matrix2Xd& points, bool add_points,
                                          std::vector<CutTriangle>* triangles);

}  // namespace rilievo
