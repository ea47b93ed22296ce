#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/decoder_c/guarded.h"
#include "client/decoder_c/surface.h"
#include "core/base/status_macros.h"
#include "core/surface/displaced_surface.h"
#include "core/voxels/shell_voxels.h"
#include "core/voxels/solid_voxels.h"
#include "core/voxels/voxel_distances.h"

struct RilievoVoxels {
  std::array<double, 4> frame{};  // corner, edge length
  std::array<uint32_t, 3> size{};
  std::vector<uint8_t> filled;
  std::vector<float> distances;
};

namespace rilievo::decoder_c {
namespace {

absl::StatusOr<VoxelGrid> GridOf(const TriangleMesh& mesh, int kind, int resolution, double voxel,
                                 int band) {
  if (kind < RILIEVO_SHELL || kind > RILIEVO_DISTANCE) {
    return absl::InvalidArgumentError(absl::StrCat("kind ", kind, ": must be from 0 to 2"));
  }
  VoxelGridOptions options;
  if (resolution != 0) {
    options.resolution = resolution;
  } else {
    options.voxel = voxel;
  }
  if (kind == RILIEVO_DISTANCE) {
    if (band < 1 || band > VoxelDistances::kMaxBand) {
      return absl::InvalidArgumentError(
          absl::StrCat("band ", band, ": must be from 1 to ", VoxelDistances::kMaxBand));
    }
    options.margin = band + 1;
  }
  return ChooseVoxelGrid(mesh, options);
}

absl::Status Fill(const TriangleMesh& mesh, const VoxelGrid& grid, int kind, int band,
                  const RunContext& context, RilievoVoxels* voxels) {
  if (kind == RILIEVO_DISTANCE) {
    RILIEVO_ASSIGN_OR_RETURN(const VoxelDistances field,
                             VoxelDistances::Build(mesh, grid, band, context));
    RILIEVO_ASSIGN_OR_RETURN(voxels->distances, field.Layers(0, grid.size.z(), context));
    return absl::OkStatus();
  }
  const absl::StatusOr<VoxelBits> bits =
      kind == RILIEVO_SHELL ? ShellVoxels(mesh, grid, context) : SolidVoxels(mesh, grid, context);
  // Older than the code for it.
  if (absl::IsFailedPrecondition(bits.status())) {
    return absl::InvalidArgumentError(bits.status().message());
  }
  RILIEVO_RETURN_IF_ERROR(bits.status());
  voxels->filled.resize(static_cast<size_t>(grid.count()));
  for (int64_t i = 0; i < grid.count(); ++i) voxels->filled[static_cast<size_t>(i)] = bits->At(i);
  return absl::OkStatus();
}

}  // namespace
}  // namespace rilievo::decoder_c

RilievoCode rilievo_voxelize(const RilievoSurface* surface, int level, int kind, int resolution,
                             double voxel, int band, int threads, RilievoVoxels** voxels) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(voxels, "voxels"));
    *voxels = nullptr;
    RILIEVO_RETURN_IF_ERROR(NotNull(surface, "surface"));
    const rilievo::DisplacedSurface& shown = surface->decoded.surface;
    rilievo::RunContext context;
    context.threads = Threads(threads);
    RILIEVO_ASSIGN_OR_RETURN(
        const rilievo::TriangleMesh mesh,
        rilievo::Tessellate(shown, level < 0 ? shown.max_level : level, context));
    RILIEVO_ASSIGN_OR_RETURN(const rilievo::VoxelGrid grid,
                             GridOf(mesh, kind, resolution, voxel, band));
    auto made = std::make_unique<RilievoVoxels>();
    made->frame = {grid.origin.x(), grid.origin.y(), grid.origin.z(), grid.voxel};
    for (int axis = 0; axis < 3; ++axis) {
      made->size[static_cast<size_t>(axis)] = static_cast<uint32_t>(grid.size[axis]);
    }
    RILIEVO_RETURN_IF_ERROR(Fill(mesh, grid, kind, band, context, made.get()));
    *voxels = made.release();
    return absl::OkStatus();
  });
}

void rilievo_voxels_free(RilievoVoxels* voxels) { delete voxels; }

const double* rilievo_voxels_frame(const RilievoVoxels* voxels, size_t* count) {
  return rilievo::decoder_c::Elements(voxels->frame, count);
}

const uint32_t* rilievo_voxels_size(const RilievoVoxels* voxels, size_t* count) {
  return rilievo::decoder_c::Elements(voxels->size, count);
}

const uint8_t* rilievo_voxels_filled(const RilievoVoxels* voxels, size_t* count) {
  return rilievo::decoder_c::Elements(voxels->filled, count);
}

const float* rilievo_voxels_distances(const RilievoVoxels* voxels, size_t* count) {
  return rilievo::decoder_c::Elements(voxels->distances, count);
}
