// How far the centres of voxels lie from a surface.
#pragma once

#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/surface/closest_point_tree.h"
#include "core/voxels/voxel_bits.h"

namespace rilievo {

// Distances are exact to the triangles up to a band of so many voxels on both sides, and the width
// of the band beyond. A closed surface gives them signs, negative inside as SolidVoxels() has it;
// those of an open one are not negative.
class VoxelDistances {
 public:
  // Layers in a row are cheapest in multiples of this.
  static constexpr int kLayers = 4;

  // `band`: in voxels, >= 1. INVALID_ARGUMENT for another band, and where the mesh does not lie
  // inside of the grid; CANCELLED.
  static absl::StatusOr<VoxelDistances> Build(const TriangleMesh& mesh, const VoxelGrid& grid,
                                              int band, const RunContext& context);

  const VoxelGrid& grid() const { return grid_; }
  bool is_signed() const { return solid_.has_value(); }
  double band() const { return band_; }  // scan unit

  // Those of the layers z in [first, first + count), in scan units; x runs fastest.
  absl::StatusOr<std::vector<float>> Layers(int first, int count, const RunContext& context) const;

 private:
  // The voxels from `low` to before `high`; `layers` begins with layer `first_layer`.
  void FillBlock(const Eigen::Vector3i& low, const Eigen::Vector3i& high, int first_layer,
                 std::vector<float>& layers) const;

  VoxelGrid grid_;
  double band_ = 0;
  ClosestPointTree tree_;
  std::optional<VoxelBits> solid_;
};

}  // namespace rilievo
