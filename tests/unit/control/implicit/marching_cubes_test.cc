#include "core/control/implicit/marching_cubes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <random>

#include "core/control/simplify/mesh_subset.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_normals.h"

namespace rilievo {
namespace {

bool OnBorder(const SparseGrid& grid, const Eigen::Vector3i& node) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const int side : {-1, 1}) {
      if (grid.Find(node + side * Eigen::Vector3i::Unit(axis)) < 0) return true;
    }
  }
  return false;
}

template <typename Field>
ImplicitFunction Sample(int size, const Field& field) {
  ImplicitFunction function;
  function.origin = Eigen::Vector3d::Constant(-0.5);
  GridLevel level;
  level.cell = 1.0 / size;
  level.grid.AddBox({0, 0, 0}, Eigen::Vector3i::Constant(size));
  level.grid.Seal();
  for (const Eigen::Vector3i& node : level.grid.Nodes()) {
    level.values.push_back(
        static_cast<float>(field(function.origin + level.cell * node.cast<double>())));
  }
  function.levels.push_back(std::move(level));
  return function;
}

// The same on nested grids: random places ask for one of `level_count` levels.
template <typename Field>
ImplicitFunction SampleNested(int size, int level_count, const Field& field) {
  ImplicitFunction function = Sample(size, field);
  std::mt19937 random(3);
  const Eigen::Matrix3Xd places = 0.4 * Eigen::Matrix3Xd::NullaryExpr(3, 60, [&] {
                                    return std::uniform_real_distribution<double>(-1, 1)(random);
                                  });
  std::vector<uint8_t> wanted(places.cols());
  for (uint8_t& level : wanted) level = static_cast<uint8_t>(random() % level_count);
  const std::vector<SparseGrid> refined =
      CellsToRefine(places, wanted, function.origin, 1.0 / size, level_count, 2, RunContext{})
          .value();
  for (const SparseGrid& cells : refined) {
    GridLevel finer = RefineCells(function.levels.back(), cells, RunContext{}).value();
    const std::vector<Eigen::Vector3i> nodes = finer.grid.Nodes();
    for (size_t n = 0; n < nodes.size(); ++n) {
      if (OnBorder(finer.grid, nodes[n])) continue;  // keeps the coarse value, as in the solver
      finer.values[n] =
          static_cast<float>(field(function.origin + finer.cell * nodes[n].cast<double>()));
    }
    function.levels.push_back(std::move(finer));
  }
  for (size_t l = function.levels.size() - 1; l > 0; --l) {
    EXPECT_TRUE(InjectValues(function.levels[l], RunContext{}, &function.levels[l - 1]).ok());
  }
  return function;
}

// The two cell edges of one cell face.
bool OnOneCellFace(int edge_a, int edge_b) {
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      const auto on_face = [&](int edge) {
        return ((kCellEdgeCorners[edge][0] >> axis) & 1) == side &&
               ((kCellEdgeCorners[edge][1] >> axis) & 1) == side;
      };
      if (on_face(edge_a) && on_face(edge_b)) return true;
    }
  }
  return false;
}

TEST(CellTableTest, EveryConfigurationCoversItsCrossedEdges) {
  for (int config = 0; config < 256; ++config) {
    std::array<bool, 12> used{};
    const CellTriangles& cell = TrianglesOfCell(config);
    for (int t = 0; t < cell.count; ++t) {
      for (const int edge : cell.edges[t]) used[edge] = true;
    }
    for (int edge = 0; edge < 12; ++edge) {
      const bool crossed = ((config >> kCellEdgeCorners[edge][0]) & 1) !=
                           ((config >> kCellEdgeCorners[edge][1]) & 1);
      EXPECT_EQ(used[edge], crossed) << "configuration " << config << ", edge " << edge;
    }
  }
}

// A side of a triangle that lies in a cell face is used once, one inside the cell twice: so two
// cells never draw the same diagonal.
TEST(CellTableTest, DiagonalsStayInsideTheCell) {
  for (int config = 0; config < 256; ++config) {
    const CellTriangles& cell = TrianglesOfCell(config);
    std::map<std::pair<int, int>, int> sides;
    for (int t = 0; t < cell.count; ++t) {
      for (int k = 0; k < 3; ++k) ++sides[{cell.edges[t][k], cell.edges[t][(k + 1) % 3]}];
    }
    for (const auto& [side, count] : sides) {
      EXPECT_EQ(count, 1);
      const bool paired = sides.count({side.second, side.first}) == 1;
      EXPECT_EQ(paired, !OnOneCellFace(side.first, side.second)) << "configuration " << config;
    }
  }
}

TEST(IsoSurfaceTest, SphereIsClosedOutwardAndRound) {
  const ImplicitFunction function =
      Sample(40, [](const Eigen::Vector3d& x) { return x.norm() - 0.37; });
  const ControlMesh mesh = ExtractIsoSurface(function, RunContext{}).value();
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_TRUE(topology.closed());
  EXPECT_TRUE(topology.manifold());
  EXPECT_TRUE(topology.oriented);
  EXPECT_EQ(topology.euler, 2);
  const Eigen::Matrix3Xd normals = VertexNormals(mesh.vertices, mesh.faces);
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    EXPECT_NEAR(mesh.vertices.col(v).norm(), 0.37, 0.001);
    EXPECT_GT(normals.col(v).dot(mesh.vertices.col(v).normalized()), 0.9);
  }
}

TEST(IsoSurfaceTest, TorusHasGenusOne) {
  const ImplicitFunction function = Sample(40, [](const Eigen::Vector3d& x) {
    return std::hypot(std::hypot(x.x(), x.y()) - 0.3, x.z()) - 0.1;
  });
  const ControlMesh mesh = ExtractIsoSurface(function, RunContext{}).value();
  EXPECT_EQ(SummarizeTopology(mesh.faces, mesh.vertices.cols()).genus, 1);
}

// White noise meets every ambiguous configuration and every pair of them.
TEST(IsoSurfaceTest, NoiseGivesAManifold) {
  std::mt19937 random(7);
  std::normal_distribution<double> gauss;
  const ImplicitFunction function = Sample(24, [&](const Eigen::Vector3d& x) {
    return x.cwiseAbs().maxCoeff() > 0.45 ? 1.0 : gauss(random);
  });
  const ControlMesh mesh = ExtractIsoSurface(function, RunContext{}).value();
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_EQ(topology.nonmanifold_edges, 0);
  EXPECT_EQ(topology.boundary_edges, 0);
  EXPECT_TRUE(topology.oriented);
  const ControlMesh split = SplitFans(mesh).mesh;
  EXPECT_TRUE(BuildMeshTopology(split.faces, split.vertices.cols()).ok());
}

TEST(IsoSurfaceTest, CellsOfThreeSizesMeetWithoutCracks) {
  const ImplicitFunction function =
      SampleNested(14, 3, [](const Eigen::Vector3d& x) { return x.norm() - 0.37; });
  ASSERT_GT(function.levels[2].grid.size(), 0);
  const ControlMesh mesh = ExtractIsoSurface(function, RunContext{}).value();
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_TRUE(topology.closed());
  EXPECT_TRUE(topology.manifold());
  EXPECT_TRUE(topology.oriented);
  EXPECT_EQ(topology.euler, 2);
  const Eigen::Matrix3Xd normals = VertexNormals(mesh.vertices, mesh.faces);
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    EXPECT_NEAR(mesh.vertices.col(v).norm(), 0.37, 0.005);
    EXPECT_GT(normals.col(v).dot(mesh.vertices.col(v).normalized()), 0.8);
  }
}

TEST(IsoSurfaceTest, NoiseInCellsOfFourSizesGivesAManifold) {
  std::mt19937 random(11);
  std::normal_distribution<double> gauss;
  const ImplicitFunction function = SampleNested(10, 4, [&](const Eigen::Vector3d& x) {
    return x.cwiseAbs().maxCoeff() > 0.45 ? 1.0 : gauss(random);
  });
  const ControlMesh mesh = ExtractIsoSurface(function, RunContext{}).value();
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_GT(topology.faces, 2000);
  EXPECT_EQ(topology.nonmanifold_edges, 0);
  EXPECT_EQ(topology.boundary_edges, 0);
  EXPECT_TRUE(topology.oriented);
  const ControlMesh split = SplitFans(mesh).mesh;
  EXPECT_TRUE(BuildMeshTopology(split.faces, split.vertices.cols()).ok());
}

TEST(IsoSurfaceTest, TheSurfaceEndsWhereTheGridEnds) {
  const ImplicitFunction function =
      Sample(20, [](const Eigen::Vector3d& x) { return x.z() - 0.01; });
  const ControlMesh mesh = ExtractIsoSurface(function, RunContext{}).value();
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_EQ(topology.boundary_loops, 1);
  EXPECT_EQ(topology.euler, 1);
  EXPECT_EQ(topology.faces, 2 * 20 * 20);
}

}  // namespace
}  // namespace rilievo
