#include "core/voxels/voxel_grid.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Eigen::Array3d;
using Eigen::Vector3d;

// What stays free on each side, between the surface and the margin.
Array3d FreeOf(const Array3d& extent, double voxel) {
  return (0x1p-21 * extent).max((voxel - extent) / 2);
}

// Voxels along each side, as real numbers because there may be far too many.
Array3d SidesOf(const Array3d& extent, double voxel, int margin) {
  return ((extent + 2 * FreeOf(extent, voxel)) / voxel - 0x1p-30).ceil() + 2.0 * margin;
}

bool Fits(const Array3d& sides) {
  return sides.maxCoeff() <= kMaxVoxelsAlongSide && sides.prod() <= static_cast<double>(kMaxVoxels);
}

absl::Status TooMany(const Array3d& extent, double voxel, const VoxelGridOptions& options) {
  const Array3d sides = SidesOf(extent, voxel, options.margin);
  double larger = voxel;
  while (!Fits(SidesOf(extent, larger, options.margin))) larger *= 1.1;
  const std::string asked = options.resolution ? absl::StrCat("resolution ", *options.resolution)
                                               : absl::StrCat("voxel ", voxel);
  const std::string advised =
      options.resolution
          ? absl::StrCat("a resolution of ", std::floor(extent.maxCoeff() / larger), " or less")
          : absl::StrCat("a voxel of ", larger, " or more");
  return absl::OutOfRangeError(absl::StrCat(
      asked, ": makes ", sides.x(), " x ", sides.y(), " x ", sides.z(), " voxels, and at most ",
      kMaxVoxels, " and ", kMaxVoxelsAlongSide, " along a side are possible; take ", advised));
}

}  // namespace

absl::Status VoxelGridOptions::Validate() const {
  if (resolution.has_value() == voxel.has_value()) {
    return absl::InvalidArgumentError("resolution: give it or a voxel, one of the two");
  }
  if (resolution && (*resolution < 1 || *resolution > kMaxVoxelResolution)) {
    return absl::InvalidArgumentError(
        absl::StrCat("resolution ", *resolution, ": must be from 1 to ", kMaxVoxelResolution));
  }
  if (voxel && !(*voxel > 0 && std::isfinite(*voxel))) {
    return absl::InvalidArgumentError(absl::StrCat("voxel ", *voxel, ": must be more than 0"));
  }
  if (margin < 1 || margin > kMaxVoxelMargin) {
    return absl::InvalidArgumentError(
        absl::StrCat("margin ", margin, ": must be from 1 to ", kMaxVoxelMargin));
  }
  return absl::OkStatus();
}

absl::StatusOr<VoxelGrid> ChooseVoxelGrid(const TriangleMesh& mesh,
                                          const VoxelGridOptions& options) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError("there are no triangles to make voxels of");
  }
  if (!mesh.vertices.allFinite()) {
    return absl::InvalidArgumentError("the mesh has a coordinate that is not finite");
  }
  const Vector3d low = mesh.vertices.rowwise().minCoeff();
  const Vector3d high = mesh.vertices.rowwise().maxCoeff();
  const Array3d extent = high - low;
  const double longest = extent.maxCoeff();
  if (!(longest > 0 && std::isfinite(longest))) {
    return absl::InvalidArgumentError("the mesh has no extent");
  }
  VoxelGrid grid;
  grid.voxel = options.voxel ? *options.voxel : longest * (1 + 0x1p-20) / *options.resolution;
  const Array3d sides = SidesOf(extent, grid.voxel, options.margin);
  if (!Fits(sides)) return TooMany(extent, grid.voxel, options);
  grid.size = sides.cast<int>();
  grid.origin = low.array() - grid.voxel * options.margin - FreeOf(extent, grid.voxel);
  return grid;
}

absl::Status CheckInside(const TriangleMesh& mesh, const VoxelGrid& grid) {
  const Array3d size = grid.size.array().cast<double>();
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    const Array3d local = grid.LocalOf(mesh.vertices.col(v));
    if ((local > 0).all() && (local < size).all()) continue;
    return absl::InvalidArgumentError(absl::StrCat("vertex ", v, " lies outside of the grid"));
  }
  return absl::OkStatus();
}

}  // namespace rilievo
