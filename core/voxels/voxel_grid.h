// The lattice of cubes that a surface is turned into voxels on.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

inline constexpr int kMaxVoxelResolution = 2048;
inline constexpr int kMaxVoxelsAlongSide = 1 << 16;
inline constexpr int64_t kMaxVoxels = int64_t{1} << 34;
inline constexpr int kMaxVoxelMargin = 1024;  // leaves room for a surface

// Voxel (x, y, z) is the closed cube from origin + voxel * (x, y, z) to the next in each direction.
struct VoxelGrid {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // scan frame
  double voxel = 1;                                  // edge length, scan unit, > 0
  Eigen::Vector3i size = Eigen::Vector3i::Ones();    // voxels along x, y and z

  int64_t count() const { return int64_t{size.x()} * size.y() * size.z(); }
  // x runs fastest, z slowest.
  int64_t Index(int x, int y, int z) const { return (int64_t{z} * size.y() + y) * size.x() + x; }
  // Scan frame.
  Eigen::Vector3d CenterOf(int x, int y, int z) const {
    return origin + voxel * (Eigen::Vector3d(x, y, z).array() + 0.5).matrix();
  }
  // In voxels from the origin.
  Eigen::Vector3d LocalOf(const Eigen::Vector3d& scan) const { return (scan - origin) / voxel; }
};

// Either field, not both.
struct VoxelGridOptions {
  std::optional<int> resolution;  // voxels along the longest side of the bounding box, [1, 2048]
  std::optional<double> voxel;    // edge length, scan unit, > 0
  int margin = 1;  // voxels on each side that the surface does not come to, [1, 1024]

  // INVALID_ARGUMENT that begins with the name of the field.
  absl::Status Validate() const;
};

// The surface begins at the margin, but for 2^-21 of its extent, so that faces along the bounding
// box do not touch the voxels beyond them; where it is thinner than a voxel it lies in the middle
// of one. INVALID_ARGUMENT where the mesh has no triangles, no extent or a coordinate that is not
// finite; OUT_OF_RANGE for more than kMaxVoxels or kMaxVoxelsAlongSide, with what would do.
absl::StatusOr<VoxelGrid> ChooseVoxelGrid(const TriangleMesh& mesh,
                                          const VoxelGridOptions& options);

// INVALID_ARGUMENT unless every vertex lies inside of the grid.
absl::Status CheckInside(const TriangleMesh& mesh, const VoxelGrid& grid);

}  // namespace rilievo
