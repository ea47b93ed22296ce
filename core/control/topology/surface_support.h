// Whether the points of a scan support a place as part of its surface.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/points/oriented_cloud.h"
#include "core/points/point_index.h"

namespace rilievo {

// What has no support within the surface is a hole that stays filled where it is at most this wide,
// in spacings of the points around; wider ones are openings of the scan.
inline constexpr double kFilledHoleSpacings = 10;

struct SurfaceSupport {
  std::vector<uint8_t> holds;  // per place
  std::vector<float> spacing;  // per place, of its nearest point
};

// A place has support where it is within reach of a point (SupportReach) whose normal agrees, but
// not where all such points lie to one side, as they do beyond the border of a scan. `normals`: of
// the surface at each place. CANCELLED when stopped.
absl::StatusOr<SurfaceSupport> FindSupport(const Eigen::Matrix3Xd& places,
                                           const Eigen::Matrix3Xd& normals,
                                           const OrientedCloud& cloud, const PointIndex& index,
                                           const RunContext& context);

}  // namespace rilievo
