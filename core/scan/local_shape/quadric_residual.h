// What a quadric leaves of a neighbourhood: its noise.
#pragma once

#include <Eigen/Core>
#include <span>

#include "core/points/settings.h"

namespace rilievo {

// RMS residual of the quadric height field over the plane of `normal`, per degree of freedom, so
// that curvature is not taken for noise and Gaussian noise is not underestimated. Where the
// residuals are those of two sheets, the RMS within them.
// Of more than kNeighborGraph.most_neighbors neighbours the first count. `normal`: unit.
// `radius`: of the neighbourhood, > 0; 0 comes back where it is not or where fewer than 7
// neighbours leave the quadric undetermined.
double QuadricResidual(const Eigen::Matrix3Xd& points, int center, std::span<const int> neighbors,
                       double radius, const Eigen::Vector3d& normal);

}  // namespace rilievo
