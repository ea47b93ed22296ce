#include "core/voxels/shell_voxels.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stop_token>
#include <utility>
#include <vector>

#include "core/voxels/solid_voxels.h"
#include "tests/unit/voxels/closed_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

VoxelGrid GridAround(const TriangleMesh& mesh, int resolution) {
  return ChooseVoxelGrid(mesh, {.resolution = resolution, .voxel = {}}).value();
}

// Whether a triangle meets the cube from low to high: what is left of it between the planes of the
// cube's faces (Sutherland and Hodgman 1974).
bool ClippedIsLeft(std::vector<Vector3d> polygon, const Vector3d& low, const Vector3d& high) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) {
      const double bound = side > 0 ? high[axis] : -low[axis];
      const auto beyond = [&](const Vector3d& p) { return side * p[axis] - bound; };
      std::vector<Vector3d> kept;
      for (size_t i = 0; i < polygon.size(); ++i) {
        const Vector3d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        const double of_p = beyond(p), of_q = beyond(q);
        if (of_p <= 0) kept.push_back(p);
        if ((of_p <= 0) != (of_q <= 0)) kept.push_back(p + of_p / (of_p - of_q) * (q - p));
      }
      polygon = std::move(kept);
    }
  }
  return !polygon.empty();
}

// Every voxel that meets a triangle is in the shell, and no other.
void ExpectAsClipped(const TriangleMesh& mesh, const VoxelGrid& grid, const VoxelBits& shell) {
  constexpr double kUndecided = 1e-8;
  int64_t wrong = 0;
  for (int z = 0; z < grid.size.z(); ++z) {
    for (int y = 0; y < grid.size.y(); ++y) {
      for (int x = 0; x < grid.size.x(); ++x) {
        const Vector3d low = Vector3d(x, y, z), high = low + Vector3d::Ones();
        const Vector3d margin = Vector3d::Constant(kUndecided);
        bool surely = false, perhaps = false;
        for (Eigen::Index t = 0; t < mesh.triangles.cols() && !surely; ++t) {
          std::vector<Vector3d> corners;
          for (int k = 0; k < 3; ++k) {
            corners.push_back(grid.LocalOf(mesh.vertices.col(mesh.triangles(k, t))));
          }
          surely = ClippedIsLeft(corners, low + margin, high - margin);
          perhaps = perhaps || ClippedIsLeft(corners, low - margin, high + margin);
        }
        const bool in = shell.At(x, y, z);
        wrong += (surely && !in) || (in && !perhaps);
      }
    }
  }
  EXPECT_EQ(wrong, 0);
}

TEST(ShellVoxelsTest, AreThoseThatATriangleMeets) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.01, 0.99);
  const auto place = [&] { return Vector3d(unit(random), unit(random), unit(random)); };
  VoxelGrid grid;
  grid.voxel = 1 / 12.0;
  grid.size = Vector3i::Constant(12);
  for (int round = 0; round < 60; ++round) {
    const Vector3d a = place(), b = place();
    Vector3d c = place();
    if (round % 4 == 1) c = a + 1e-9 * c;       // a sliver
    if (round % 4 == 2) c = a + (b - a) * 0.3;  // a segment
    TriangleMesh mesh = MeshOf({a, b, c}, {{0, 1, 2}});
    if (round % 4 == 3) {  // within one plane or on the faces of voxels
      mesh.vertices.row(round % 3).setConstant((round % 8 + 2) / 12.0);
    }
    const auto shell = ShellVoxels(mesh, grid, {});
    ASSERT_TRUE(shell.ok()) << shell.status();
    EXPECT_GT(shell->Count(), 0);
    ExpectAsClipped(mesh, grid, *shell);
  }
}

// A ten millionth of a voxel beside the face of two voxels it meets only one of them.
TEST(ShellVoxelsTest, TouchOnlyWhatIsTouched) {
  VoxelGrid grid;
  grid.size = {8, 8, 8};
  for (const auto& [x, layers] : {std::pair{5.0, 2}, {5 + 1e-7, 1}, {5 - 1e-7, 1}}) {
    const TriangleMesh mesh = MeshOf({{x, 2.2, 2.2}, {x, 2.8, 2.2}, {x, 2.8, 5.8}, {x, 2.2, 5.8}},
                                     {{0, 1, 2}, {0, 2, 3}});
    EXPECT_EQ(ShellVoxels(mesh, grid, {})->Count(), 4 * layers) << x;
  }
}

TEST(ShellVoxelsTest, OfATorusIsMinimal) {
  const TriangleMesh torus = Moved(TorusMesh(0.7, 0.28, 24, 12), Askew());
  const VoxelGrid grid = GridAround(torus, 24);
  const auto shell = ShellVoxels(torus, grid, {});
  ASSERT_TRUE(shell.ok()) << shell.status();
  ExpectAsClipped(torus, grid, *shell);
}

TEST(ShellVoxelsTest, HoldsEveryPointOfTheSurface) {
  std::mt19937_64 random(11);
  const TriangleMesh torus = Moved(TorusMesh(0.7, 0.28, 90, 40), Askew());
  for (const int resolution : {16, 300}) {
    const VoxelGrid grid = GridAround(torus, resolution);
    const auto shell = ShellVoxels(torus, grid, {});
    ASSERT_TRUE(shell.ok()) << shell.status();
    int64_t outside = 0;
    for (int i = 0; i < 200'000; ++i) {
      const Vector3i voxel = grid.LocalOf(RandomPlace(torus, random)).array().floor().cast<int>();
      outside += !shell->At(voxel.x(), voxel.y(), voxel.z());
    }
    EXPECT_EQ(outside, 0) << resolution;
  }
}

// The voxels that a walk through faces from voxel (0, 0, 0) reaches without entering the shell.
VoxelBits ReachedFromOutside(const VoxelBits& shell) {
  const VoxelGrid& grid = shell.grid;
  VoxelBits reached(grid);
  std::vector<Vector3i> open = {Vector3i::Zero()};
  reached.SetRun(0, 1);
  while (!open.empty()) {
    const Vector3i at = open.back();
    open.pop_back();
    for (int way = 0; way < 6; ++way) {
      Vector3i next = at;
      next[way / 2] += way % 2 == 0 ? 1 : -1;
      if (next.minCoeff() < 0 || (next.array() >= grid.size.array()).any()) continue;
      const int64_t index = grid.Index(next.x(), next.y(), next.z());
      if (shell.At(index) || reached.At(index)) continue;
      reached.SetRun(index, index + 1);
      open.push_back(next);
    }
  }
  return reached;
}

// Between shell and outside lies the inside, as the winding numbers say.
void ExpectNoLeak(const TriangleMesh& mesh, int resolution) {
  const VoxelGrid grid = GridAround(mesh, resolution);
  const auto shell = ShellVoxels(mesh, grid, {});
  const auto solid = SolidVoxels(mesh, grid, {});
  ASSERT_TRUE(shell.ok() && solid.ok()) << shell.status() << solid.status();
  const VoxelBits reached = ReachedFromOutside(*shell);
  int64_t inside = 0, wrong = 0;
  for (int64_t i = 0; i < grid.count(); ++i) {
    if (shell->At(i)) continue;
    inside += solid->At(i);
    wrong += solid->At(i) == reached.At(i);
  }
  EXPECT_GT(inside, 0);
  EXPECT_EQ(wrong, 0);
}

TEST(ShellVoxelsTest, ClosedShellsDoNotLeak) {
  ExpectNoLeak(SphereMesh(5), 40);
  ExpectNoLeak(BoxMesh({0, 0, 0}, {1, 1, 1}), 31);
  for (const int resolution : {20, 57, 128}) {
    ExpectNoLeak(Moved(TorusMesh(0.7, 0.28, 60, 30), Askew()), resolution);
  }
}

// A box is so large that it is parted among threads.
TEST(ShellVoxelsTest, AreTheSameForAnyNumberOfThreads) {
  const TriangleMesh box = Moved(BoxMesh({0, 0, 0}, {1, 1, 1}), Askew());
  const VoxelGrid grid = GridAround(box, 200);
  RunContext one, four;
  one.threads = 1;
  four.threads = 4;
  EXPECT_EQ(ShellVoxels(box, grid, one)->words, ShellVoxels(box, grid, four)->words);
}

TEST(ShellVoxelsTest, EndsWhenAskedTo) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  const TriangleMesh sphere = SphereMesh(2);
  EXPECT_EQ(ShellVoxels(sphere, GridAround(sphere, 8), context).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(ShellVoxelsTest, RefusesAMeshBesideTheGrid) {
  const TriangleMesh sphere = SphereMesh(2);
  VoxelGrid grid = GridAround(sphere, 8);
  grid.origin.x() += 1;
  EXPECT_EQ(ShellVoxels(sphere, grid, {}).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
