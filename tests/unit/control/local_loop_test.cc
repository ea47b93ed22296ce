#include "core/control/local_loop.h"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

// The tube's girth is 2 pi 0.12 = 0.75, the hole's edge 2 pi 0.18 = 1.13.
TEST(LocalLoopTest, FindsTheGirthOfATorus) {
  const ControlMesh mesh =
      MarchTetrahedra([](const Eigen::Vector3d& x) { return TorusField(x); }, 24);
  const MeshTopology topology =
      BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())).value();
  LocalLoopFinder finder(topology, mesh.vertices);
  EXPECT_TRUE(finder.LoopAround(0, 0.2).empty()) << "the disc closes nowhere";
  const std::vector<int> loop = finder.LoopAround(0, 0.8);
  ASSERT_GE(loop.size(), 3U);
  EXPECT_EQ(std::set<int>(loop.begin(), loop.end()).size(), loop.size());
  const double girth = 2 * std::numbers::pi * 0.12;
  EXPECT_GT(finder.Length(loop), 0.95 * girth);
  EXPECT_LT(finder.Length(loop), 1.4 * girth);
  EXPECT_TRUE(finder.PatchIsFlat(0, 0.2));
  EXPECT_FALSE(finder.PatchIsFlat(0, 0.8));
  const std::vector<int>& disc = finder.Disc(0, 0.2);
  ASSERT_GT(disc.size(), 1U);
  EXPECT_EQ(disc[0], 0);
  for (const int v : disc) EXPECT_LE((mesh.vertices.col(v) - mesh.vertices.col(0)).norm(), 0.2);
}

TEST(LocalLoopTest, ASphereHasNone) {
  const ControlMesh mesh = MarchTetrahedra(SphereField, 16);
  const MeshTopology topology =
      BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())).value();
  LocalLoopFinder finder(topology, mesh.vertices);
  for (const int root : {0, 50, 200}) {
    EXPECT_TRUE(finder.LoopAround(root, 5).empty());
    EXPECT_TRUE(finder.PatchIsFlat(root, 5));
  }
  EXPECT_EQ(finder.Patch(0, 5).size(), static_cast<size_t>(topology.vertex_count));
}

}  // namespace
}  // namespace rilievo
