// How many points the surface of a mesh is made of.
#pragma once

#include <cstdint>
#include <functional>

#include "absl/status/statusor.h"
#include "core/pipeline/reconstruct.h"

namespace rilievo {

// RMS distance between a mesh and its surface, fraction of the diagonal, where no error is asked
// for.
inline constexpr double kMeshError = 1e-4;

// What `run` makes with FewPointsOnTriangles(), and where that is farther from the mesh than
// kMeshError, or than the error asked for, the nearer of it and of what `run` makes with
// PointsOnTriangles(): small details of a part take more points and control faces than its area
// has. Once where there are as many already, faces, level or bytes are given, or nothing is
// measured. `triangles`: of the mesh. The first error of `run`.
absl::StatusOr<Reconstruction> WithEnoughPoints(
    int64_t triangles, const ReconstructOptions& options,
    const std::function<absl::StatusOr<Reconstruction>(int64_t points)>& run);

}  // namespace rilievo
