// Voxels by the C interface against the C++ library.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"
#include "core/codec/container/dss.h"
#include "core/surface/displaced_surface.h"
#include "core/voxels/shell_voxels.h"
#include "core/voxels/voxel_distances.h"
#include "tests/unit/decoder_c/c_objects.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

using VoxelsPtr = Owned<RilievoVoxels>;

class CVoxelsTest : public testing::Test {
 protected:
  CVoxelsTest() {
    const std::vector<uint8_t> bytes = Golden("torus_and_sheet_smoothed_v3.dss");
    const DisplacedSurface surface = DecodeDss(bytes, RunContext())->surface;
    mesh_ = *Tessellate(surface, surface.max_level, RunContext());
    surface_ = Decode(bytes);
  }

  // That this is refused, and what is said.
  std::string Refused(int level, int kind, int resolution, double voxel, int band) {
    auto* voxels = reinterpret_cast<RilievoVoxels*>(this);
    EXPECT_EQ(rilievo_voxelize(surface_.get(), level, kind, resolution, voxel, band, 1, &voxels),
              RILIEVO_INVALID_ARGUMENT);
    EXPECT_EQ(voxels, nullptr);
    return rilievo_last_error();
  }

  TriangleMesh mesh_;
  SurfacePtr surface_;
};

TEST_F(CVoxelsTest, ShellIsThatOfTheCppLibrary) {
  const VoxelGrid grid = *ChooseVoxelGrid(mesh_, {.resolution = 50, .voxel = {}});
  const VoxelBits expected = *ShellVoxels(mesh_, grid, {});
  RilievoVoxels* made = nullptr;
  ASSERT_EQ(rilievo_voxelize(surface_.get(), -1, RILIEVO_SHELL, 50, 0, 0, 2, &made), RILIEVO_OK)
      << rilievo_last_error();
  const VoxelsPtr voxels(made);
  size_t count = 0;
  const double* frame = rilievo_voxels_frame(made, &count);
  ASSERT_EQ(count, 4u);
  EXPECT_EQ(Eigen::Vector3d(frame), grid.origin);
  EXPECT_EQ(frame[3], grid.voxel);
  const uint32_t* size = rilievo_voxels_size(made, &count);
  ASSERT_EQ(count, 3u);
  EXPECT_EQ(Eigen::Vector3i(size[0], size[1], size[2]), grid.size);
  const uint8_t* filled = rilievo_voxels_filled(made, &count);
  ASSERT_EQ(static_cast<int64_t>(count), grid.count());
  int64_t wrong = 0;
  for (size_t i = 0; i < count; ++i) wrong += filled[i] != expected.At(static_cast<int64_t>(i));
  EXPECT_EQ(wrong, 0);
  rilievo_voxels_distances(made, &count);
  EXPECT_EQ(count, 0u);
}

TEST_F(CVoxelsTest, DistancesAreThoseOfTheCppLibrary) {
  const double voxel = (mesh_.vertices.row(0).maxCoeff() - mesh_.vertices.row(0).minCoeff()) / 30;
  const VoxelGrid grid = *ChooseVoxelGrid(mesh_, {.resolution = {}, .voxel = voxel, .margin = 3});
  const VoxelDistances expected = *VoxelDistances::Build(mesh_, grid, 2, {});
  RilievoVoxels* made = nullptr;
  ASSERT_EQ(rilievo_voxelize(surface_.get(), -1, RILIEVO_DISTANCE, 0, voxel, 2, 2, &made),
            RILIEVO_OK)
      << rilievo_last_error();
  const VoxelsPtr voxels(made);
  size_t count = 0;
  const float* distances = rilievo_voxels_distances(made, &count);
  EXPECT_EQ(std::vector<float>(distances, distances + count),
            *expected.Layers(0, grid.size.z(), {}));
  rilievo_voxels_filled(made, &count);
  EXPECT_EQ(count, 0u);
}

TEST_F(CVoxelsTest, RefusalsNameWhatIsWrong) {
  EXPECT_THAT(Refused(-1, RILIEVO_SOLID, 20, 0, 0), HasSubstr("the surface is open"));
  EXPECT_THAT(Refused(-1, 3, 20, 0, 0), HasSubstr("kind 3"));
  EXPECT_THAT(Refused(99, RILIEVO_SHELL, 20, 0, 0), HasSubstr("99"));
  EXPECT_THAT(Refused(-1, RILIEVO_SHELL, -20, 0, 0), HasSubstr("resolution -20"));
  EXPECT_THAT(Refused(-1, RILIEVO_SHELL, 0, 0, 0), HasSubstr("voxel 0"));
  EXPECT_THAT(Refused(-1, RILIEVO_SHELL, 0, 1e-9, 0), HasSubstr("take a voxel of"));
  EXPECT_THAT(Refused(-1, RILIEVO_DISTANCE, 20, 0, 0), HasSubstr("band 0"));
  EXPECT_THAT(Refused(-1, RILIEVO_DISTANCE, 20, 0, 2147483647), HasSubstr("band 2147483647"));
  RilievoVoxels* voxels = nullptr;
  EXPECT_EQ(rilievo_voxelize(nullptr, 0, 0, 8, 0, 1, 0, &voxels), RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_voxelize(surface_.get(), 0, 0, 8, 0, 1, 0, nullptr), RILIEVO_INVALID_ARGUMENT);
  rilievo_voxels_free(nullptr);
}

}  // namespace
}  // namespace rilievo
