// How far a place is from a triangle.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// Squared distance from `point` to the triangle a, b, c, degenerate ones included (Ericson,
// Real-Time Collision Detection, 5.1.5).
double SquaredDistanceToTriangle(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                                 const Eigen::Vector3d& b, const Eigen::Vector3d& c);

// Barycentric coordinates of the place of the triangle that is nearest to `point`.
Eigen::Vector3d ClosestWeights(const Eigen::Vector3d& point, const Eigen::Vector3d& a,
                               const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace rilievo
