// How far the centres of voxels lie from a surface.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/voxels/triangle_pieces.h"
#include "core/voxels/voxel_bits.h"

namespace rilievo {

// Distances are exact to the triangles up to a band of so many voxels on both sides, and the width
// of the band beyond. A closed surface gives them signs, negative inside as SolidVoxels() has it;
// those of an open one are not negative. Each triangle is measured from the voxels that its box,
// widened by the band, holds (S. Mauch, "Efficient algorithms for solving static Hamilton-Jacobi
// equations", 2003, with boxes for his prisms), slab by slab, so that no grid of distances needs to
// be in memory.
class VoxelDistances {
 public:
  // Layers asked for at once are shared among threads in slabs of so many, from layer 0.
  static constexpr int kSlab = 4;
  static constexpr int kMaxBand = kMaxVoxelMargin - 1;

  // `band`: in voxels, [1, kMaxBand]. INVALID_ARGUMENT for another band, and where the mesh does
  // not lie inside of the grid; CANCELLED.
  static absl::StatusOr<VoxelDistances> Build(const TriangleMesh& mesh, const VoxelGrid& grid,
                                              int band, const RunContext& context);

  const VoxelGrid& grid() const { return grid_; }
  bool is_signed() const { return solid_.has_value(); }
  double band() const { return band_ * grid_.voxel; }  // scan unit

  // Those of the layers z in [first, first + count), in scan units; x runs fastest.
  // INVALID_ARGUMENT for layers that the grid does not have; CANCELLED.
  absl::StatusOr<std::vector<float>> Layers(int first, int count, const RunContext& context) const;

 private:
  // Squared distances in voxels, those of layers [first, end) of one slab.
  void MeasureSlab(int first, int end, float* squared) const;
  void MeasurePiece(const TrianglePiece& piece, int first, int end, float* squared) const;

  VoxelGrid grid_;
  int band_ = 1;  // voxels
  std::vector<TrianglePiece> pieces_;
  // Slab s is near the pieces numbered near_[near_begin_[s]] to before near_[near_begin_[s + 1]].
  std::vector<int64_t> near_begin_;
  std::vector<int> near_;
  std::optional<VoxelBits> solid_;
};

// The volume inside of a closed surface whose distances at the centres of voxels these are: of each
// voxel the share 0.5 - distance / voxel, from 0 to 1. That is exact where faces lie along the
// axes, however far into a layer of voxels they reach, and walls are at least a voxel thick; what
// curvature adds falls with the square of the voxels. `voxel`: edge length, of the unit of the
// distances.
double VolumeInside(std::span<const float> distances, double voxel);

}  // namespace rilievo
