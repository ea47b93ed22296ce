// The normal at a point of a clean scan, on its own side of an edge.
#pragma once

#include <Eigen/Core>
#include <span>

#include "core/scan/local_shape/settings.h"

namespace rilievo {

// Of three surfaces through the point the one that passes closest to most of its neighbours:
// the quadric of all of them, as on a smooth surface; the best of the planes through the point and
// two of the nearest (Li et al. 2010, Boulch and Marlet 2012: robust normals at sharp features);
// and the quadric of those that lie by that plane, as on the wall of a hole. So the side of an edge
// is found where it is a few points wide, and no bias of a curved side is left.
// `normal`: unit, of the plane of all, which height fields stand on and which comes back where
// fewer neighbours than kRobustNormal.fewest_robust_neighbors settle nothing. Of the neighbours,
// nearest first, the first 17 count. `spacing`: > 0. `noise`: measurement noise at the point; both
// in the frame of `points`.
Eigen::Vector3d RobustNormal(const Eigen::Matrix3Xd& points, int center,
                             std::span<const int> neighbors, double spacing, double noise,
                             const Eigen::Vector3d& normal);

}  // namespace rilievo
