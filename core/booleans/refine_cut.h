// Triangles of a cut face made well shaped.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/booleans/cut_loops.h"

namespace rilievo {

// Diagonals are flipped until they are Delaunay's. Where `add_points`, points are added inside, as
// dense as the points of the loops near them and thinner farther away: the centres of the cells of
// a quadtree (M. Bern, D. Eppstein, J. Gilbert, "Provably Good Mesh Generation", 1994). So
// triangles grow with the distance from a fine loop, where there were long thin ones. `points`: of
// the corners, in a plane. Returns the points added; the first is corner points.cols().
std::vector<Eigen::Vector2d> RefineCut(const Eigen::Matrix2Xd& points, bool add_points,
                                       std::vector<CutTriangle>* triangles);

}  // namespace rilievo
