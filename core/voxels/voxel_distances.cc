#include "core/voxels/voxel_distances.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/voxels/solid_voxels.h"

namespace rilievo {
namespace {

constexpr int kBlockSide = VoxelDistances::kLayers;

}  // namespace

absl::StatusOr<VoxelDistances> VoxelDistances::Build(const TriangleMesh& mesh,
                                                     const VoxelGrid& grid, int band,
                                                     const RunContext& context) {
  if (band < 1) {
    return absl::InvalidArgumentError(absl::StrCat("band ", band, ": must be at least 1"));
  }
  RILIEVO_RETURN_IF_ERROR(CheckInside(mesh, grid));
  VoxelDistances made;
  made.grid_ = grid;
  made.band_ = band * grid.voxel;
  RILIEVO_ASSIGN_OR_RETURN(made.tree_,
                           ClosestPointTree::Build(mesh.vertices, mesh.triangles, context));
  if (EnclosesVolume(mesh)) {
    RILIEVO_ASSIGN_OR_RETURN(made.solid_, SolidVoxels(mesh, grid, context));
  }
  return made;
}

absl::StatusOr<std::vector<float>> VoxelDistances::Layers(int first, int count,
                                                          const RunContext& context) const {
  if (first < 0 || count < 0 || first + count > grid_.size.z()) {
    return absl::InvalidArgumentError(absl::StrCat("layers ", first, " to ", first + count,
                                                   ": must be from 0 to ", grid_.size.z()));
  }
  std::vector<float> layers(static_cast<size_t>(grid_.Index(0, 0, count)));
  const auto blocks_in = [](int voxels) { return (voxels + kBlockSide - 1) / kBlockSide; };
  const int rows = blocks_in(grid_.size.y());
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(int64_t{rows} * blocks_in(count), 1, context, [&](int64_t begin, int64_t end) {
        for (int64_t row = begin; row < end; ++row) {
          const int y = static_cast<int>(row % rows) * kBlockSide;
          const int z = first + static_cast<int>(row / rows) * kBlockSide;
          const Eigen::Vector3i last(grid_.size.x(), grid_.size.y(), first + count);
          for (int x = 0; x < grid_.size.x(); x += kBlockSide) {
            const Eigen::Vector3i low(x, y, z);
            const Eigen::Vector3i high = (low.array() + kBlockSide).min(last.array());
            FillBlock(low, high, first, layers);
          }
        }
      }));
  return layers;
}

void VoxelDistances::FillBlock(const Eigen::Vector3i& low, const Eigen::Vector3i& high,
                               int first_layer, std::vector<float>& layers) const {
  const Eigen::Vector3d first = grid_.CenterOf(low.x(), low.y(), low.z());
  const Eigen::Vector3d last = grid_.CenterOf(high.x() - 1, high.y() - 1, high.z() - 1);
  const double radius = (last - first).norm() / 2;
  const bool near = tree_.HasWithin((first + last) / 2, (band_ + radius) * (1 + 1e-9));
  int hint = -1;
  for (int z = low.z(); z < high.z(); ++z) {
    for (int y = low.y(); y < high.y(); ++y) {
      for (int x = low.x(); x < high.x(); ++x) {
        const int64_t index = grid_.Index(x, y, z);
        double distance = band_;
        if (near) {
          const ClosestPointTree::Hit hit = tree_.Closest(grid_.CenterOf(x, y, z), hint);
          hint = hit.item;
          distance = std::min(band_, std::sqrt(hit.squared_distance));
        }
        if (solid_ && solid_->At(index)) distance = -distance;
        layers[static_cast<size_t>(index - grid_.Index(0, 0, first_layer))] =
            static_cast<float>(distance);
      }
    }
  }
}

}  // namespace rilievo
