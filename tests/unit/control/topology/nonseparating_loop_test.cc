#include "core/control/topology/nonseparating_loop.h"

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
  NonseparatingLoopFinder finder(topology, mesh.vertices);
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
  NonseparatingLoopFinder finder(topology, mesh.vertices);
  for (const int root : {0, 50, 200}) {
    EXPECT_TRUE(finder.LoopAround(root, 5).empty());
    EXPECT_TRUE(finder.PatchIsFlat(root, 5));
  }
  EXPECT_EQ(finder.Patch(0, 5).size(), static_cast<size_t>(topology.vertex_count));
}

// Handles of a patch that is one piece and pinched nowhere are those of its faces.
TEST(LocalLoopTest, APatchIsFlatWhereItsFacesHaveNoHandle) {
  ControlMesh mesh = MarchTetrahedra(TwoToriField, 24);
  mesh.faces.conservativeResize(3, mesh.faces.cols() - 1);  // a boundary
  const int vertex_count = static_cast<int>(mesh.vertices.cols());
  const MeshTopology topology = BuildMeshTopology(mesh.faces, vertex_count).value();
  NonseparatingLoopFinder finder(topology, mesh.vertices);
  int compared = 0, with_handles = 0;
  for (int root = 0; root < vertex_count; root += 7) {
    for (const double radius : {0.05, 0.1, 0.2, 0.3, 0.45, 2.0}) {
      const std::vector<int>& patch = finder.Patch(root, radius);
      std::vector<uint8_t> inside(static_cast<size_t>(vertex_count), 0);
      for (const int v : patch) inside[v] = 1;
      Eigen::Matrix3Xi faces(3, mesh.faces.cols());
      int count = 0;
      for (const auto face : mesh.faces.colwise()) {
        if (inside[face[0]] && inside[face[1]] && inside[face[2]]) faces.col(count++) = face;
      }
      faces.conservativeResize(3, count);
      const TopologySummary summary = SummarizeTopology(faces, vertex_count);
      if (summary.components != 1 || summary.nonmanifold_vertices > 0) continue;
      ++compared;
      with_handles += summary.genus > 0 ? 1 : 0;
      EXPECT_EQ(finder.PatchIsFlat(root, radius), summary.genus == 0) << root << " " << radius;
    }
  }
  EXPECT_GT(with_handles, 50);
  EXPECT_GT(compared - with_handles, 50);
}

}  // namespace
}  // namespace rilievo
