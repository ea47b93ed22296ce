// Whether the points contradict that the surface passes a place.
#pragma once

#include <Eigen/Core>

#include "core/displacement/rays/ray_cloud.h"
#include "core/points/neighbor_graph.h"

namespace rilievo {

// A place on the surface lies amid the points around it, and on the tangent planes of the nearest
// ones. True where it lies farther from the mean of the nearest eight than the points of an edge do
// from theirs: where a plane was taken on past the rim of a hole. True as well where it lies off
// those planes: over a quarter of a spacing and 1.5 deviations of noise, the median of the nearest
// five that face along `direction`. The corner of a box and the rim of an open scan are
// contradicted as often as not: to be asked of places that stand out anyhow. `index` holds the
// points of `cloud`; unit frame.
bool ContradictsPoints(const RayCloud& cloud, const PointIndex& index, const Eigen::Vector3d& place,
                       const Eigen::Vector3d& direction);

}  // namespace rilievo
