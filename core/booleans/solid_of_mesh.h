// Triangles of a file as a solid to combine.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// CheckMesh() without its frame and without triangles that face each other: vertices stay where
// they are in the points of `mesh`, and solids glued at a whole face are one.
absl::StatusOr<TriangleMesh> SolidOfMesh(const PointCloud& mesh, const RunContext& context);

}  // namespace rilievo
