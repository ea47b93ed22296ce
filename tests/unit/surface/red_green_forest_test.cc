#include "core/surface/red_green_forest.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "core/loop/refinement.h"
#include "tests/unit/loop/loop_meshes.h"

namespace rilievo {
namespace {

bool FirstIsShorter(RedGreenForest::Diagonal x, RedGreenForest::Diagonal y) {
  return x.first < y.first;
}

Eigen::Matrix3Xi TrianglesOf(const RedGreenForest& forest) {
  std::vector<std::array<int, 3>> all, triangles;
  forest.ForEachLeaf([&](LevelFace leaf) {
    forest.TrianglesOf(leaf, FirstIsShorter, triangles);
    all.insert(all.end(), triangles.begin(), triangles.end());
  });
  Eigen::Matrix3Xi matrix(3, static_cast<Eigen::Index>(all.size()));
  for (size_t t = 0; t < all.size(); ++t) {
    for (size_t k = 0; k < 3; ++k) {
      matrix(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(t)) = all[t][k];
    }
  }
  return matrix;
}

class RedGreenForestTest : public ::testing::TestWithParam<testing::NamedMesh> {
 protected:
  const ControlMesh& mesh() const { return GetParam().mesh; }
};

TEST_P(RedGreenForestTest, UncutAndCutAllThroughAreTheLevelsThemselves) {
  const auto refinement = RefineTopology(mesh(), 2, RunContext());
  const std::span levels(refinement->levels.data(), 2);
  RedGreenForest forest(levels);
  EXPECT_EQ(TrianglesOf(forest), mesh().faces);
  std::vector<LevelFace> made;
  for (int level = 0; level < 2; ++level) {
    for (int f = 0; f < levels[static_cast<size_t>(level)].face_count(); ++f) {
      forest.Cut({level, f}, made);
    }
    EXPECT_EQ(TrianglesOf(forest), refinement->levels[static_cast<size_t>(level) + 1].faces);
  }
}

// Whatever is cut: what is left is a manifold of the same Euler number and borders, with no vertex
// in the middle of a neighbour's edge.
TEST_P(RedGreenForestTest, IsWatertightWhateverIsCut) {
  const auto refinement = RefineTopology(mesh(), 4, RunContext());
  const TopologySummary whole =
      SummarizeTopology(mesh().faces, static_cast<int>(mesh().vertices.cols()));
  uint32_t random = 7;
  RedGreenForest forest(std::span(refinement->levels.data(), 4));
  for (int round = 0; round < 30; ++round) {
    std::vector<LevelFace> leaves, made;
    forest.ForEachLeaf([&](LevelFace leaf) {
      if (leaf.level < 4) leaves.push_back(leaf);
    });
    if (leaves.empty()) break;
    random = random * 1664525u + 1013904223u;
    forest.Cut(leaves[random % leaves.size()], made);
    const Eigen::Matrix3Xi triangles = TrianglesOf(forest);
    const TopologySummary left =
        SummarizeTopology(triangles, refinement->levels.back().vertex_count);
    ASSERT_TRUE(left.manifold() && left.oriented) << round;
    EXPECT_EQ(left.euler, whole.euler) << round;
    EXPECT_EQ(left.boundary_loops, whole.boundary_loops) << round;
    EXPECT_EQ(left.components, whole.components) << round;
  }
}

TEST_P(RedGreenForestTest, NeighboursDifferByOneLevelAtMost) {
  const auto refinement = RefineTopology(mesh(), 4, RunContext());
  RedGreenForest forest(std::span(refinement->levels.data(), 4));
  std::vector<LevelFace> made;
  for (int level = 0, face = 0; level < 4; ++level, face = 4 * face + 1) {
    forest.Cut({level, face}, made);
    for (const LevelFace at : made) EXPECT_TRUE(forest.IsCut({at.level - 1, at.face / 4}));
  }
  forest.ForEachLeaf([&](LevelFace leaf) {
    if (leaf.level >= 3) return;
    const MeshTopology& topology = refinement->levels[static_cast<size_t>(leaf.level)];
    for (int k = 0; k < 3; ++k) {
      const int neighbor = topology.face_neighbors(k, leaf.face);
      if (neighbor < 0 || !forest.IsCut({leaf.level, neighbor})) continue;
      // The two children along the shared edge are not cut again.
      const int edge = topology.face_edges(k, leaf.face);
      for (int child = 0; child < 3; ++child) {
        const MeshTopology& fine = refinement->levels[static_cast<size_t>(leaf.level) + 1];
        const int at = 4 * neighbor + child;
        for (int side = 0; side < 3; ++side) {
          const int across = fine.face_neighbors(side, at);
          if (across >= 0 && across / 4 == leaf.face && topology.edge_vertices(0, edge) >= 0) {
            EXPECT_FALSE(forest.IsCut({leaf.level + 1, at}));
          }
        }
      }
    }
  });
}

INSTANTIATE_TEST_SUITE_P(Meshes, RedGreenForestTest, ::testing::ValuesIn(testing::LoopMeshes()),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace rilievo
