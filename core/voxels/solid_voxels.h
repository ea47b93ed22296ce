// The voxels inside of a closed surface.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/voxels/voxel_bits.h"

namespace rilievo {

// Whether the triangles enclose a volume: every edge is used as often in one direction as in the
// other.
bool EnclosesVolume(const TriangleMesh& mesh);

// The voxels whose centre has a winding number other than 0: cavities stay empty, and parts that
// overlap are filled once. Along each row of centres the crossings with triangles are found in
// exact integers, with vertices rounded to 2^-20 of a voxel. A centre on the surface, or a row
// through a vertex or an edge, is decided as if all centres were moved by (e^1, e^2, e^3) for a
// tiny e (H. Edelsbrunner and E. Muecke, "Simulation of simplicity", ACM TOG 9(1), 1990).
// INVALID_ARGUMENT where the mesh does not lie inside of the grid, FAILED_PRECONDITION where it is
// open; CANCELLED.
absl::StatusOr<VoxelBits> SolidVoxels(const TriangleMesh& mesh, const VoxelGrid& grid,
                                      const RunContext& context);

}  // namespace rilievo
