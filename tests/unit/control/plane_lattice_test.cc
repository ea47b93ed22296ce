#include "core/control/plane_lattice.h"

#include <gtest/gtest.h>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

OccupiedArea Drawn(const std::function<bool(double, double)>& inside) {
  OccupiedArea area;
  area.cell = 0.01;
  area.columns = area.rows = 120;
  area.inside.resize(120 * 120);
  for (int i = 0; i < 120 * 120; ++i) {
    area.inside[i] = inside((i % 120 + 0.5) * 0.01, (i / 120 + 0.5) * 0.01) ? 1 : 0;
  }
  FillHoles(0, BoundaryRule::kKeep, &area);
  return area;
}

double AreaOf(const ControlMesh& mesh) {
  double sum = 0;
  for (const auto& face : mesh.faces.colwise()) {
    const Eigen::Vector3d a = mesh.vertices.col(face[0]), b = mesh.vertices.col(face[1]),
                          c = mesh.vertices.col(face[2]);
    const double doubled = (b - a).cross(c - a).z();
    EXPECT_GT(doubled, 0);
    sum += doubled / 2;
  }
  return sum;
}

TEST(TriangulateArea, FillsARingWithRoundFaces) {
  const OccupiedArea ring = Drawn([](double x, double y) {
    const double r = std::hypot(x - 0.6, y - 0.6);
    return r > 0.2 && r < 0.5;
  });
  const ControlMesh mesh = TriangulateArea(ring, 0.05);
  const TopologySummary summary = Summary(mesh);
  EXPECT_TRUE(summary.manifold());
  EXPECT_TRUE(summary.oriented);
  EXPECT_EQ(summary.components, 1);
  EXPECT_EQ(summary.boundary_loops, 2);
  EXPECT_EQ(summary.genus, 0);
  EXPECT_NEAR(AreaOf(mesh), std::numbers::pi * (0.25 - 0.04), 0.02);
  const std::vector<double> roundness = Roundnesses(mesh);
  EXPECT_GT(Mean(roundness), 0.9);
  EXPECT_GT(*std::min_element(roundness.begin(), roundness.end()), 0.25);
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  ASSERT_TRUE(topology.ok());
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    if (topology->boundary_vertex[v] == 0) continue;
    const double depth = ring.Depth(mesh.vertices.col(v).head<2>());
    EXPECT_LT(std::abs(depth), 0.02);
  }
}

TEST(TriangulateArea, HasNoBowTies) {
  // A chess board of squares that touch at their corners, at an edge length that meets them badly.
  const OccupiedArea board = Drawn([](double x, double y) {
    return (static_cast<int>(x / 0.15) + static_cast<int>(y / 0.15)) % 2 == 0;
  });
  for (const double edge : {0.03, 0.047, 0.08}) {
    const ControlMesh mesh = TriangulateArea(board, edge);
    ASSERT_GT(mesh.faces.cols(), 0);
    const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
    EXPECT_TRUE(topology.ok()) << topology.status();
  }
}

TEST(TriangulateArea, KeepsEachIslandThatIsLargeEnough) {
  const OccupiedArea islands = Drawn([](double x, double y) {
    return std::hypot(x - 0.3, y - 0.3) < 0.2 || std::hypot(x - 0.9, y - 0.9) < 0.15 ||
           std::hypot(x - 0.9, y - 0.3) < 0.02;
  });
  EXPECT_EQ(Summary(TriangulateArea(islands, 0.05)).components, 2);
}

TEST(TriangulateArea, GivesNothingForASpeck) {
  const OccupiedArea speck =
      Drawn([](double x, double y) { return std::hypot(x - 0.6, y - 0.6) < 0.02; });
  EXPECT_EQ(TriangulateArea(speck, 0.2).faces.cols(), 0);
}

}  // namespace
}  // namespace rilievo
