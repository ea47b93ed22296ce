// How far the points of a scan lie from a mesh, told at its vertices.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// One value a vertex: the RMS distance of the points whose nearest triangle touches it, in the
// scan's unit; NaN where there is none. Non-finite points are passed over. INVALID_ARGUMENT for a
// mesh without triangles.
absl::StatusOr<std::vector<float>> ErrorAtVertices(const TriangleMesh& mesh,
                                                   const Eigen::Matrix3Xd& points,
                                                   const RunContext& context);

}  // namespace rilievo
