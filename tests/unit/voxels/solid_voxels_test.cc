#include "core/voxels/solid_voxels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "core/surface/mass_properties.h"
#include "tests/unit/voxels/closed_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using ::testing::HasSubstr;

VoxelGrid SolidGridAround(const TriangleMesh& mesh, int resolution) {
  return ChooseVoxelGrid(mesh, {.resolution = resolution, .voxel = {}}).value();
}

double VolumeOf(const VoxelBits& solid) {
  return static_cast<double>(solid.Count()) * std::pow(solid.grid.voxel, 3);
}

// Voxels of edge length 1 whose centres have whole coordinates.
VoxelGrid LatticeGrid(int size) {
  VoxelGrid grid;
  grid.origin.setConstant(-1.5);
  grid.size.setConstant(size + 3);
  return grid;
}

VoxelBits SolidOf(const TriangleMesh& mesh, const VoxelGrid& grid) {
  auto solid = SolidVoxels(mesh, grid, {});
  EXPECT_TRUE(solid.ok()) << solid.status();
  return *std::move(solid);
}

TEST(SolidVoxelsTest, HaveTheVolumeOfTheMesh) {
  for (const TriangleMesh& mesh : {SphereMesh(4), TorusMesh(0.7, 0.28, 60, 30),
                                   Moved(TorusMesh(0.7, 0.28, 60, 30), Askew())}) {
    const double volume = MassPropertiesOf(mesh.vertices, mesh.triangles)->volume;
    EXPECT_NEAR(VolumeOf(SolidOf(mesh, SolidGridAround(mesh, 256))) / volume, 1, 1e-3);
  }
  const TriangleMesh torus = TorusMesh(0.7, 0.28, 200, 100);
  EXPECT_NEAR(VolumeOf(SolidOf(torus, SolidGridAround(torus, 256))) /
                  (2 * std::numbers::pi * std::numbers::pi * 0.7 * 0.28 * 0.28),
              1, 2e-3);
}

TEST(SolidVoxelsTest, AreThoseWhoseCentreIsInside) {
  const TriangleMesh torus = TorusMesh(0.7, 0.28, 300, 150);  // within 2e-4 of the torus
  const VoxelGrid grid = SolidGridAround(torus, 100);
  const VoxelBits solid = SolidOf(torus, grid);
  int64_t wrong = 0;
  for (int z = 0; z < grid.size.z(); ++z) {
    for (int y = 0; y < grid.size.y(); ++y) {
      for (int x = 0; x < grid.size.x(); ++x) {
        const Vector3d center = grid.CenterOf(x, y, z);
        const double depth =
            0.28 - std::hypot(std::hypot(center.x(), center.y()) - 0.7, center.z());
        wrong += std::abs(depth) > 2e-4 && solid.At(x, y, z) != (depth > 0);
      }
    }
  }
  EXPECT_EQ(wrong, 0);
}

// All vertices, edges and faces pass through centres of voxels: a box of whole sides has as many
// voxels as its volume says, wherever it lies.
TEST(SolidVoxelsTest, OfBoxesOnTheLatticeAreExact) {
  const VoxelGrid grid = LatticeGrid(9);
  for (int side = 1; side <= 8; side += 3) {
    const Vector3d low(1, 0, 1), high = low + Vector3d(side, 9, 4);
    EXPECT_EQ(SolidOf(BoxMesh(low, high), grid).Count(), side * 9 * 4);
  }
}

// Parts that fill a cube fill its voxels once each.
TEST(SolidVoxelsTest, PartsOnTheLatticeNeitherOverlapNorGape) {
  constexpr int kSide = 8;
  const VoxelGrid grid = LatticeGrid(kSide);
  const VoxelBits cube = SolidOf(BoxMesh(Vector3d::Zero(), Vector3d::Constant(kSide)), grid);
  VoxelBits sum(grid);
  int64_t count = 0;
  std::array<int, 3> order = {0, 1, 2};
  do {  // the tetrahedra along the six ways from one corner of the cube to the other
    std::vector<Vector3d> corners = {Vector3d::Zero()};
    for (const int axis : order) corners.push_back(corners.back() + kSide * Vector3d::Unit(axis));
    TriangleMesh part = MeshOf(corners, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}});
    if (MassPropertiesOf(part.vertices, part.triangles)->volume < 0) {
      part = InsideOut(std::move(part));
    }
    const VoxelBits solid = SolidOf(part, grid);
    count += solid.Count();
    for (size_t w = 0; w < sum.words.size(); ++w) sum.words[w] |= solid.words[w];
  } while (std::next_permutation(order.begin(), order.end()));
  EXPECT_EQ(count, kSide * kSide * kSide);
  EXPECT_EQ(sum.words, cube.words);
}

TEST(SolidVoxelsTest, CavitiesAreEmptyAndOverlapsFilledOnce) {
  const VoxelGrid grid = LatticeGrid(10);
  const TriangleMesh outer = BoxMesh(Vector3d::Zero(), Vector3d::Constant(10));
  const TriangleMesh inner = BoxMesh(Vector3d::Constant(2), Vector3d::Constant(5));
  EXPECT_EQ(SolidOf(Together(outer, InsideOut(inner)), grid).Count(), 1000 - 27);
  EXPECT_EQ(SolidOf(InsideOut(Together(outer, InsideOut(inner))), grid).Count(), 1000 - 27);
  EXPECT_EQ(SolidOf(Together(outer, inner), grid).Count(), 1000);
  const TriangleMesh beside = BoxMesh({1, 1, 1}, {4, 3, 9});
  const TriangleMesh across = BoxMesh({2, 0, 4}, {10, 2, 6});
  EXPECT_EQ(SolidOf(Together(beside, across), grid).Count(), 3 * 2 * 8 + 8 * 2 * 2 - 2 * 1 * 2);
}

TEST(SolidVoxelsTest, FarFromTheOriginToo) {
  const Vector3d far(4.5e6, 5.3e5, 300);
  const TriangleMesh near = Moved(TorusMesh(7, 2.8, 60, 30), Askew());
  const TriangleMesh moved = Moved(near, Eigen::Affine3d(Eigen::Translation3d(far)));
  const int64_t count = SolidOf(near, SolidGridAround(near, 64)).Count();
  EXPECT_NEAR(static_cast<double>(SolidOf(moved, SolidGridAround(moved, 64)).Count()),
              static_cast<double>(count), 1e-3 * static_cast<double>(count));
}

TEST(SolidVoxelsTest, AreTheSameForAnyNumberOfThreads) {
  const TriangleMesh sphere = Moved(SphereMesh(6), Askew());
  const VoxelGrid grid = SolidGridAround(sphere, 300);
  RunContext one, four;
  one.threads = 1;
  four.threads = 4;
  EXPECT_EQ(SolidVoxels(sphere, grid, one)->words, SolidVoxels(sphere, grid, four)->words);
}

TEST(SolidVoxelsTest, RefusesWhatIsOpen) {
  TriangleMesh sphere = SphereMesh(2);
  EXPECT_TRUE(EnclosesVolume(sphere));
  const VoxelGrid grid = SolidGridAround(sphere, 8);
  std::swap(sphere.triangles(0, 3), sphere.triangles(1, 3));  // one the other way round
  EXPECT_FALSE(EnclosesVolume(sphere));
  sphere.triangles.conservativeResize(3, sphere.triangles.cols() - 1);
  const auto solid = SolidVoxels(sphere, grid, {});
  EXPECT_EQ(solid.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(solid.status().message()), HasSubstr("make a shell"));
  EXPECT_FALSE(EnclosesVolume({}));
}

}  // namespace
}  // namespace rilievo
