#include "core/loop/sharp_refinement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "core/geometry/half_edges.h"
#include "core/loop/refinement.h"
#include "tests/unit/loop/crease_meshes.h"

namespace rilievo {
namespace {

using testing::Refine;

class SharpRefinementTest : public ::testing::TestWithParam<testing::NamedMesh> {
 protected:
  const ControlMesh& mesh() const { return GetParam().mesh; }
};

// Sharpness by pairs of vertices, refined without any edge number.
TEST_P(SharpRefinementTest, EdgesSplitInTwoAndLoseOne) {
  const LoopRefinement refinement = Refine(mesh(), 3);
  std::map<std::pair<int, int>, float> sharp;
  for (const Crease& crease : mesh().creases) {
    sharp[{crease.a, crease.b}] = std::min(crease.sharpness, kInfiniteSharpness);
  }
  for (int l = 0; l <= 3; ++l) {
    const MeshTopology& topology = refinement.levels[l];
    std::map<std::pair<int, int>, float> found, halves;
    const SharpLevel level = refinement.sharp.empty() ? SharpLevel() : refinement.sharp.levels[l];
    int before = -1;
    for (const SharpEdge& edge : level.edges) {
      EXPECT_LT(std::exchange(before, edge.edge), edge.edge);
      EXPECT_GE(topology.edge_faces(1, edge.edge), 0);
      found[{topology.edge_vertices(0, edge.edge), topology.edge_vertices(1, edge.edge)}] =
          edge.sharpness;
    }
    for (int e = 0; e < topology.edge_count(); ++e) {
      const int a = topology.edge_vertices(0, e), b = topology.edge_vertices(1, e);
      const auto tag = sharp.find({a, b});
      if (tag == sharp.end()) continue;
      if (topology.edge_faces(1, e) < 0) {
        sharp.erase(tag);  // a boundary edge needs no tag
        continue;
      }
      const float next = tag->second >= 10.0f ? 10.0f : tag->second - 1.0f;
      if (next <= 0.0f) continue;
      halves[{a, topology.vertex_count + e}] = next;
      halves[{b, topology.vertex_count + e}] = next;
    }
    EXPECT_EQ(found, sharp) << "level " << l;
    sharp = std::move(halves);
  }
}

TEST_P(SharpRefinementTest, ControlRingsAreTheVertexRings) {
  const LoopRefinement refinement = Refine(mesh(), 0);
  const MeshTopology& control = refinement.levels[0];
  const VertexRings rings = BuildVertexRings(control);
  std::vector<uint8_t> expected(control.vertex_count, 0);
  for (const Crease& crease : mesh().creases) {
    for (int e = 0; e < control.edge_count(); ++e) {
      if (control.edge_faces(1, e) >= 0 && control.edge_vertices(0, e) == crease.a &&
          control.edge_vertices(1, e) == crease.b) {
        expected[crease.a] = expected[crease.b] = 1;
      }
    }
  }
  for (int corner : mesh().corners) expected[corner] = 1;
  std::vector<uint8_t> listed(control.vertex_count, 0);
  for (const SharpControlVertex& sharp : refinement.sharp.control) {
    listed[sharp.vertex] = 1;
    EXPECT_EQ(sharp.neighbors,
              std::vector<int>(rings.neighbors.begin() + rings.neighbor_begin[sharp.vertex],
                               rings.neighbors.begin() + rings.neighbor_begin[sharp.vertex + 1]));
    ASSERT_EQ(sharp.half_edges.size(),
              sharp.neighbors.size() - control.boundary_vertex[sharp.vertex]);
    for (size_t i = 0; i < sharp.half_edges.size(); ++i) {
      const uint32_t h = sharp.half_edges[i];
      EXPECT_EQ(Origin(control.faces, h), sharp.vertex);
      EXPECT_EQ(Origin(control.faces, NextHalfEdge(h)), sharp.neighbors[i]);
    }
    EXPECT_EQ(sharp.limit.position.size(), sharp.neighbors.size() + 1);
  }
  EXPECT_EQ(listed, expected);
}

TEST_P(SharpRefinementTest, RowsAreAffineAndOfNeighbours) {
  const LoopRefinement refinement = Refine(mesh(), 2);
  for (int l = 0; l <= 2 && !refinement.sharp.empty(); ++l) {
    const MeshTopology& topology = refinement.levels[l];
    const VertexRings rings = BuildVertexRings(topology);
    const SharpLevel& level = refinement.sharp.levels[l];
    ASSERT_EQ(level.begin.size(), level.vertices.size() + 1);
    EXPECT_TRUE(std::is_sorted(level.vertices.begin(), level.vertices.end()));
    for (size_t i = 0; i < level.vertices.size(); ++i) {
      const int v = level.vertices[i];
      EXPECT_EQ(level.neighbors[level.begin[i]], v);
      double sum = level.weights[level.begin[i]];
      for (int n = level.begin[i] + 1; n < level.begin[i + 1]; ++n) {
        const auto begin = rings.neighbors.begin() + rings.neighbor_begin[v];
        const auto end = rings.neighbors.begin() + rings.neighbor_begin[v + 1];
        EXPECT_NE(std::find(begin, end, level.neighbors[n]), end);
        sum += level.weights[n];
      }
      EXPECT_NEAR(sum, 1.0, 1e-15);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, SharpRefinementTest, ::testing::ValuesIn(testing::CreaseMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

TEST(SharpRefinementEmptyTest, SmoothMeshesAndBoundaryTagsCarryNothing) {
  ControlMesh mesh = testing::Grid(4, 4);
  EXPECT_TRUE(Refine(mesh, 2).sharp.empty());
  mesh.creases = {{0, 1}, {1, 2, 0.5f}};
  EXPECT_TRUE(Refine(mesh, 2).sharp.empty());
}

// A cube keeps its shape when all of its edges are sharp.
TEST(SharpRefinementCubeTest, StaysACube) {
  const ControlMesh cube = testing::SharpCube();
  const LoopRefinement refinement = Refine(cube, 3);
  const auto limit = EvaluateLimit(refinement, cube.vertices, 3, RunContext());
  ASSERT_TRUE(limit.ok());
  EXPECT_LT((limit->positions.cwiseAbs().colwise().maxCoeff().array() - 1.0).abs().maxCoeff(),
            1e-14);
  for (int v = 0; v < limit->normals.cols(); ++v) {
    // Where a, b and c faces meet the normal is their mean direction.
    Eigen::Vector3d expected = Eigen::Vector3d::Zero();
    for (int k = 0; k < 3; ++k) {
      const double x = limit->positions(k, v);
      if (std::abs(x) > 1.0 - 1e-9) expected[k] = x;
    }
    EXPECT_LT((limit->normals.col(v) - expected.normalized()).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace rilievo
