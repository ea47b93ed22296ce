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

struct SurfaceSupport {
  std::vector<uint8_t> holds;  // per place
  std::vector<float> spacing;  // per place, of its nearest point
};

// A place has support where a point whose normal agrees lies within 1.6 of the point's spacings, or
// four times its noise, but not where all such points lie to one side, as they do beyond the border
// of a scan. `normals`: of the surface at each place. CANCELLED when stopped.
absl::StatusOr<SurfaceSupport> FindSupport(const Eigen::Matrix3Xd& places,
                                           const Eigen::Matrix3Xd& normals,
                                           const OrientedCloud& cloud, const PointIndex& index,
                                           const RunContext& context);

}  // namespace rilievo
