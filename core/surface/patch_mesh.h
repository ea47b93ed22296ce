// Triangles and normals of a refined surface, patch by patch.
#pragma once

#include <Eigen/Core>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/loop_patches.h"

namespace rilievo {

// The triangles of the patches' level in the order of LoopRefinement, over `vertices`, which has a
// column for each vertex of the level. With `with_normals` the mesh has normals too: area-weighted,
// as VertexNormals() takes them, up to rounding. The same for any number of threads.
absl::StatusOr<TriangleMesh> MeshOfPatches(const LoopPatches& patches, Eigen::Matrix3Xd vertices,
                                           bool with_normals, const RunContext& context);

}  // namespace rilievo
