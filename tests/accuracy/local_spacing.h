// How far the points of a scan are apart, place by place.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/points/point_index.h"

namespace rilievo {

// By point: the distance of its sixth neighbour over 1.4, which is the spacing of an even scan, and
// no more than the 95th percentile of the scan. Unit of the points.
std::vector<float> LocalSpacing(const Eigen::Matrix3Xd& points, const PointIndex& index);

}  // namespace rilievo
