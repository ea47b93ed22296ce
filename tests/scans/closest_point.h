// The nearest point of a smooth implicit surface.
#pragma once

#include <Eigen/Core>
#include <span>

#include "tests/scans/analytic_shape.h"

namespace rilievo {

// Nearest to `x` among the points that the iteration reaches from `starts` (near the surface, at
// least one). Tangential steps with reprojection, whose error shrinks by distance times curvature
// a round, then Newton on p - x + lambda grad f(p) = 0, f(p) = 0.
Eigen::Vector3d ClosestPointOnImplicit(const AnalyticShape& shape, const Eigen::Vector3d& x,
                                       std::span<const Eigen::Vector3d> starts);

}  // namespace rilievo
