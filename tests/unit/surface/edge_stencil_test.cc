#include "core/surface/edge_stencil.h"

#include <algorithm>
#include <set>

#include "gtest/gtest.h"

namespace rilievo {
namespace {

// The regular triangulation of a rows x columns lattice, diagonals from (i, j) to (i + 1, j + 1).
Eigen::Matrix3Xi Lattice(int rows, int columns) {
  Eigen::Matrix3Xi faces(3, 2 * (rows - 1) * (columns - 1));
  int f = 0;
  for (int i = 0; i + 1 < rows; ++i) {
    for (int j = 0; j + 1 < columns; ++j) {
      const int a = i * columns + j, b = a + columns;
      faces.col(f++) << a, b, b + 1;
      faces.col(f++) << a, b + 1, a + 1;
    }
  }
  return faces;
}

int EdgeBetween(const MeshTopology& topology, int a, int b) {
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (topology.edge_vertices(0, e) == a && topology.edge_vertices(1, e) == b) return e;
  }
  return -1;
}

TEST(EdgeStencilTest, InsideALattice) {
  const MeshTopology topology = *BuildMeshTopology(Lattice(6, 6), 36);
  // The edge (2, 2) - (3, 2): faces to (3, 3) and (2, 1).
  const EdgeStencil stencil = StencilOfEdge(topology, EdgeBetween(topology, 14, 20));
  EXPECT_EQ(stencil.ends, (std::array<int, 2>{14, 20}));
  EXPECT_EQ((std::set<int>(stencil.opposite.begin(), stencil.opposite.end())),
            (std::set<int>{21, 13}));
  EXPECT_EQ((std::set<int>(stencil.wings.begin(), stencil.wings.end())),
            (std::set<int>{15, 27, 7, 19}));
  EXPECT_TRUE(stencil.interior());
  EXPECT_TRUE(stencil.complete());
}

TEST(EdgeStencilTest, AtTheBoundary) {
  const MeshTopology topology = *BuildMeshTopology(Lattice(6, 6), 36);
  const EdgeStencil boundary = StencilOfEdge(topology, EdgeBetween(topology, 0, 6));
  EXPECT_FALSE(boundary.interior());
  EXPECT_EQ(boundary.opposite[0], 7);
  EXPECT_EQ(boundary.opposite[1], -1);
  EXPECT_EQ(boundary.wings[2], -1);
  const EdgeStencil beside = StencilOfEdge(topology, EdgeBetween(topology, 0, 7));
  EXPECT_TRUE(beside.interior());
  EXPECT_FALSE(beside.complete());
}

// The butterfly reproduces any polynomial of degree two on a regular lattice (and more): so does
// its stencil, whichever edge.
TEST(EdgeStencilTest, ButterflyReproducesQuadratics) {
  const MeshTopology topology = *BuildMeshTopology(Lattice(8, 8), 64);
  const auto value = [](double x, double y) {
    return 3 + 2 * x - y + x * x - 2 * x * y + y * y / 2;
  };
  int tested = 0;
  for (int e = 0; e < topology.edge_count(); ++e) {
    const EdgeStencil s = StencilOfEdge(topology, e);
    if (!s.complete()) continue;
    const auto at = [&](int v) { return value(v / 8, v % 8); };
    const double x = (s.ends[0] / 8 + s.ends[1] / 8) / 2.0;
    const double y = (s.ends[0] % 8 + s.ends[1] % 8) / 2.0;
    const double predicted =
        (at(s.ends[0]) + at(s.ends[1])) / 2 + (at(s.opposite[0]) + at(s.opposite[1])) / 8 -
        (at(s.wings[0]) + at(s.wings[1]) + at(s.wings[2]) + at(s.wings[3])) / 16;
    EXPECT_NEAR(predicted, value(x, y), 1e-12);
    ++tested;
  }
  EXPECT_GT(tested, 50);
}

}  // namespace
}  // namespace rilievo
