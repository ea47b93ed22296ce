// Where displacement has turned the surface over.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Triangles that displacement has turned over, of `vertices` and `triangles` over `limit`: their
// normal points against the sum of the limit normals at their corners, or all their edges run
// against those of the limit triangle. Heights beyond one radius of curvature do the first, beyond
// both the second; steep ones do neither. CANCELLED is the only error.
absl::StatusOr<int64_t> CountFolds(const LimitSurface& limit, const Eigen::Matrix3Xd& vertices,
                                   const Eigen::Matrix3Xi& triangles, const RunContext& context);

}  // namespace rilievo
