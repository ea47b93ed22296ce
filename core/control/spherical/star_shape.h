// Whether a cloud is the surface of a star-shaped body: met once by each ray from a centre.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// The place from which most of the surface is seen from inside: starts at the centroid of the
// points' areas and moves until each normal points away from it, if it can. Deterministic; looks
// at a few thousand points.
Eigen::Vector3d FindStarCenter(const OrientedCloud& cloud);

struct StarCheck {
  double coverage = 0;      // share of directions in which there are points
  double single_sheet = 0;  // share of the directions met whose points lie on one sheet
  double outward = 0;       // share of points whose normal turns away from the centre at all
  double radial = 0;        // share of points whose normal is within 53 degrees of the ray
  double radius_ratio = 0;  // largest over smallest distance from the centre (1 % cut off each)
};

absl::StatusOr<StarCheck> CheckStarShape(const OrientedCloud& cloud, const Eigen::Vector3d& center,
                                         const RunContext& context);

}  // namespace rilievo
