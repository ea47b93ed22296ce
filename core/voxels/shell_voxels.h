// The voxels that a surface passes through.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/voxels/voxel_bits.h"

namespace rilievo {

// The triangles are halved in parameter space until a piece spans few voxels, which are then tested
// one by one (S. Lai and F. Cheng, "Voxelization of free-form solids represented by Catmull-Clark
// subdivision surfaces", GMP 2006; here for the triangles of a displaced surface). As there the
// result is
//   - separating: no path through faces of voxels leads through the surface between them,
//   - accurate: every point of the surface lies in a voxel of the shell,
//   - minimal: every voxel of the shell meets the surface, or misses it by kVoxelSlack at most.
// INVALID_ARGUMENT where the mesh does not lie inside of the grid; CANCELLED.
absl::StatusOr<VoxelBits> ShellVoxels(const TriangleMesh& mesh, const VoxelGrid& grid,
                                      const RunContext& context);

}  // namespace rilievo
