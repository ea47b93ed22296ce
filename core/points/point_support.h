// Whether a scan has points near a place.
#pragma once

#include <Eigen/Core>

#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// How far from a point the surface may lie: 1.6 of its spacings, or four times its noise.
double SupportReach(const OrientedCloud& cloud, int point);

// Whether `place` (unit frame) is within reach of the point nearest to it. `index` holds the points
// of `cloud`.
bool HasSupport(const OrientedCloud& cloud, const PointIndex& index, const Eigen::Vector3d& place);

}  // namespace rilievo
