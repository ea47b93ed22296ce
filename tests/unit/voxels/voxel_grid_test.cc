#include "core/voxels/voxel_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "tests/unit/voxels/closed_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using ::testing::HasSubstr;

const TriangleMesh kBrick = BoxMesh({1, 2, 3}, {5, 4, 4});  // 4 x 2 x 1

TEST(VoxelGridTest, TheLongestSideSpansTheResolution) {
  const auto grid = ChooseVoxelGrid(kBrick, {.resolution = 8, .voxel = {}});
  ASSERT_TRUE(grid.ok()) << grid.status();
  EXPECT_EQ(grid->size, Vector3i(10, 6, 4));  // and a voxel on each side
  EXPECT_NEAR(grid->voxel, 0.5, 1e-6);
  EXPECT_EQ(grid->count(), 240);
  EXPECT_EQ(grid->Index(9, 5, 3), 239);
  EXPECT_LT((grid->origin - Vector3d(0.5, 1.5, 2.5)).norm(), 1e-5);
}

TEST(VoxelGridTest, TheSurfaceKeepsOffTheMargin) {
  for (const int margin : {1, 4}) {
    for (const VoxelGridOptions& options :
         {VoxelGridOptions{.resolution = 1, .voxel = {}, .margin = margin},
          VoxelGridOptions{.resolution = 2048, .voxel = {}, .margin = margin},
          VoxelGridOptions{.resolution = {}, .voxel = 0.5, .margin = margin},
          VoxelGridOptions{.resolution = {}, .voxel = 7, .margin = margin}}) {
      const auto grid = ChooseVoxelGrid(kBrick, options);
      ASSERT_TRUE(grid.ok()) << grid.status();
      const Vector3d low = grid->LocalOf({1, 2, 3}), high = grid->LocalOf({5, 4, 4});
      EXPECT_GT(low.minCoeff(), margin + 1e-7);
      EXPECT_GT((grid->size.cast<double>() - high).minCoeff(), margin + 1e-7);
      EXPECT_TRUE(CheckInside(kBrick, *grid).ok());
    }
  }
}

TEST(VoxelGridTest, FlatShapesHaveALayer) {
  const TriangleMesh flat = MeshOf({{0, 0, 5}, {1, 0, 5}, {0, 1, 5}}, {{0, 1, 2}});
  const auto grid = ChooseVoxelGrid(flat, {.resolution = 10, .voxel = {}});
  ASSERT_TRUE(grid.ok()) << grid.status();
  EXPECT_EQ(grid->size, Vector3i(12, 12, 3));
}

TEST(VoxelGridTest, TheVoxelThatIsAdvisedIsTaken) {
  for (const double voxel : {1e-4, 1e-7, 1e-300}) {
    const auto refused = ChooseVoxelGrid(kBrick, {.resolution = {}, .voxel = voxel});
    ASSERT_EQ(refused.status().code(), absl::StatusCode::kOutOfRange);
    const std::string said(refused.status().message());
    const std::string before = "take a voxel of ";
    ASSERT_THAT(said, HasSubstr(before));
    const double advised = std::stod(said.substr(said.find(before) + before.size()));
    const auto taken = ChooseVoxelGrid(kBrick, {.resolution = {}, .voxel = 1.001 * advised});
    ASSERT_TRUE(taken.ok()) << taken.status();
    EXPECT_LE(taken->count(), kMaxVoxels);
    EXPECT_GT(taken->count(), kMaxVoxels / 3);
  }
}

TEST(VoxelGridTest, TheResolutionThatIsAdvisedIsTaken) {
  const TriangleMesh cube = BoxMesh({0, 0, 0}, {1, 1, 1});
  VoxelGridOptions options{.resolution = 2048, .voxel = {}, .margin = kMaxVoxelMargin};
  const auto refused = ChooseVoxelGrid(cube, options);
  ASSERT_EQ(refused.status().code(), absl::StatusCode::kOutOfRange);
  const std::string said(refused.status().message());
  const std::string before = "take a resolution of ";
  EXPECT_THAT(said, HasSubstr("resolution 2048: makes 4096 x 4096 x 4096 voxels"));
  ASSERT_THAT(said, HasSubstr(before));
  options.resolution = std::stoi(said.substr(said.find(before) + before.size()));
  EXPECT_TRUE(ChooseVoxelGrid(cube, options).ok());
}

TEST(VoxelGridTest, RefusesWhatHasNoVoxels) {
  const auto said = [](const TriangleMesh& mesh, const VoxelGridOptions& options) {
    const auto grid = ChooseVoxelGrid(mesh, options);
    EXPECT_EQ(grid.status().code(), absl::StatusCode::kInvalidArgument);
    return std::string(grid.status().message());
  };
  EXPECT_THAT(said(kBrick, {}), HasSubstr("one of the two"));
  EXPECT_THAT(said(kBrick, {.resolution = 8, .voxel = 1.0}), HasSubstr("one of the two"));
  EXPECT_THAT(said(kBrick, {.resolution = 0, .voxel = {}}),
              HasSubstr("resolution 0: must be from 1 to 2048"));
  EXPECT_THAT(said(kBrick, {.resolution = 2049, .voxel = {}}), HasSubstr("resolution 2049"));
  EXPECT_THAT(said(kBrick, {.resolution = {}, .voxel = -1.0}),
              HasSubstr("voxel -1: must be more than 0"));
  EXPECT_THAT(said(kBrick, {.resolution = {}, .voxel = std::nan("")}), HasSubstr("voxel nan"));
  EXPECT_THAT(said(kBrick, {.resolution = 8, .voxel = {}, .margin = 0}), HasSubstr("margin 0"));
  EXPECT_THAT(said(kBrick, {.resolution = 8, .voxel = {}, .margin = 1025}),
              HasSubstr("margin 1025"));
  EXPECT_THAT(said({}, {.resolution = 8, .voxel = {}}), HasSubstr("no triangles"));
  TriangleMesh mesh = MeshOf({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{0, 1, 2}});
  EXPECT_THAT(said(mesh, {.resolution = 8, .voxel = {}}), HasSubstr("no extent"));
  mesh.vertices(0, 1) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(said(mesh, {.resolution = 8, .voxel = {}}), HasSubstr("not finite"));
}

}  // namespace
}  // namespace rilievo
