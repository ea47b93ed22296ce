// Whether a scan has points near a place.
#pragma once

#include <Eigen/Core>

#include "core/points/neighbor_graph.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// A crease or corner lies about a spacing from the points of its sides; the crossing of planes that
// meet flatly may lie anywhere. True within so many `spacings` and a deviation of noise of the
// point nearest to `place` (unit frame). `index` holds the points of `cloud`.
bool HasSupport(const OrientedCloud& cloud, const PointIndex& index, const Eigen::Vector3d& place,
                double spacings);

}  // namespace rilievo
