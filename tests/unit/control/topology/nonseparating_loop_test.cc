#include "core/control/topology/nonseparating_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <numeric>
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
  NonseparatingLoopFinder finder(topology, mesh.vertices);
  EXPECT_TRUE(finder.LoopAround(0, 0.2).empty()) << "the disc closes nowhere";
  const std::vector<int> loop = finder.LoopAround(0, 0.8);
  ASSERT_GE(loop.size(), 3U);
  EXPECT_EQ(std::set<int>(loop.begin(), loop.end()).size(), loop.size());
  const double girth = 2 * std::numbers::pi * 0.12;
  EXPECT_GT(finder.Length(loop), 0.95 * girth);
  EXPECT_LT(finder.Length(loop), 1.4 * girth);
  const std::vector<int>& disc = finder.Disc(0, 0.2);
  ASSERT_GT(disc.size(), 1U);
  EXPECT_EQ(disc[0], 0);
  for (const int v : disc) EXPECT_LE((mesh.vertices.col(v) - mesh.vertices.col(0)).norm(), 0.2);
}

TEST(LocalLoopTest, ASphereHasNone) {
  const ControlMesh mesh = MarchTetrahedra(SphereField, 16);
  const MeshTopology topology =
      BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())).value();
  NonseparatingLoopFinder finder(topology, mesh.vertices);
  for (const int root : {0, 50, 200}) EXPECT_TRUE(finder.LoopAround(root, 5).empty());
  std::vector<uint8_t> marks(static_cast<size_t>(topology.vertex_count), 0);
  EXPECT_EQ(finder.MarkLoops(3, &marks).size(), marks.size());
  EXPECT_EQ(std::accumulate(marks.begin(), marks.end(), 0), 0);
}

// Of two tori that have grown together and are open: whatever loop goes around a handle meets a
// marked one.
TEST(LocalLoopTest, EveryLoopAroundAHandleMeetsAMarkedOne) {
  ControlMesh mesh = MarchTetrahedra(TwoToriField, 24);
  mesh.faces.conservativeResize(3, mesh.faces.cols() - 1);
  const int vertex_count = static_cast<int>(mesh.vertices.cols());
  const MeshTopology topology = BuildMeshTopology(mesh.faces, vertex_count).value();
  NonseparatingLoopFinder finder(topology, mesh.vertices);
  std::vector<uint8_t> marks(static_cast<size_t>(vertex_count), 0);
  EXPECT_EQ(finder.MarkLoops(0, &marks).size(), marks.size());
  const int marked = std::accumulate(marks.begin(), marks.end(), 0);
  EXPECT_LT(marked, vertex_count / 4);
  int loops = 0;
  for (int root = 0; root < vertex_count; root += 7) {
    const std::vector<int> loop = finder.LoopAround(root, 0.45);
    if (loop.empty()) continue;
    ++loops;
    EXPECT_TRUE(std::ranges::any_of(loop, [&](int v) { return marks[v] != 0; })) << root;
  }
  EXPECT_GT(loops, 50);
}

}  // namespace
}  // namespace rilievo
