// Closest-point distances to line segments.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {

// Columns 2 i and 2 i + 1 of `ends` are the ends of item i; at least one. CANCELLED is the only
// error.
absl::StatusOr<ClosestPointTree> TreeOfSegments(const Eigen::Matrix3Xd& ends,
                                                const RunContext& context);

// A place on a segment, and the unit vector along it.
struct SegmentPlace {
  Eigen::Vector3d place, along;
};
// The nearest one to `position`. `tree`: TreeOfSegments(ends).
SegmentPlace NearestOnSegments(const ClosestPointTree& tree, const Eigen::Matrix3Xd& ends,
                               const Eigen::Vector3d& position);
// The nearest one that runs the way `direction` points, rather than against it, among the 64
// nearest of all; where none of them does, the nearest of all.
SegmentPlace NearestAlong(const ClosestPointTree& tree, const Eigen::Matrix3Xd& ends,
                          const Eigen::Vector3d& position, const Eigen::Vector3d& direction);

}  // namespace rilievo
