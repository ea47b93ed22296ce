// Where displacement has turned the surface over.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/loop/refinement.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// Triangles of level max_level that displacement has turned over: their normal points against the
// sum of the limit normals at their corners, or all their edges run against those of the limit
// triangle. Heights beyond one radius of curvature do the first, beyond both the second; steep ones
// do neither.
// INVALID_ARGUMENT as Tessellate().
absl::StatusOr<int64_t> CountFolds(const DisplacedSurface& surface, const RunContext& context);

// The same of `vertices` and `triangles` over `limit`, whose positions and normals are those of
// these vertices.
absl::StatusOr<int64_t> CountFolds(const LimitSurface& limit, const Eigen::Matrix3Xd& vertices,
                                   const Eigen::Matrix3Xi& triangles, const RunContext& context);

}  // namespace rilievo
