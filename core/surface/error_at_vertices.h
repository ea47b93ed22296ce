// How far the points of a scan lie from a mesh, told at its vertices.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

struct VertexErrors {
  // One value a vertex: the RMS distance of the points whose nearest triangle touches it; NaN where
  // there is none.
  std::vector<float> at_vertex;
  double rms = 0;  // of all points; 0 without any
};

// Distances in the unit of `points` (columns, in the mesh's frame) to the nearest triangle.
// Non-finite points are passed over. INVALID_ARGUMENT for a mesh without triangles.
absl::StatusOr<VertexErrors> ErrorAtVertices(const TriangleMesh& mesh,
                                             const Eigen::Matrix3Xd& points,
                                             const RunContext& context);

}  // namespace rilievo
