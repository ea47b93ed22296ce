// Heights on the domain's creases: where a ray between two sides comes to the planes of both.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "core/displacement/rays/height_samples.h"
#include "core/displacement/rays/ray_cloud.h"
#include "core/points/neighbor_graph.h"

namespace rilievo {

// Of the ray from `position` along the unit `direction`, the height that is nearest to the planes
// of all sides (least squares of the distances). A side's plane is that of the nearest points whose
// normals agree with its own, column of `side_normals`, better than with the others'. Nothing
// unless two sides have points. `index` holds the cloud's points.
std::optional<HeightEstimate> MeetAlongRay(const RayCloud& cloud, const PointIndex& index,
                                           const Eigen::Vector3d& position,
                                           const Eigen::Vector3d& direction,
                                           const Eigen::Matrix3Xd& side_normals);

}  // namespace rilievo
