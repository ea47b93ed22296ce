#include "core/control/planar/plane_lattice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>

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

double AreaOfFaces(const ControlMesh& mesh) {
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
  const ControlMesh mesh = TriangulateArea(ring, 0.05, RunContext{}).value();
  const TopologySummary summary = Summary(mesh);
  EXPECT_TRUE(summary.manifold());
  EXPECT_TRUE(summary.oriented);
  EXPECT_EQ(summary.components, 1);
  EXPECT_EQ(summary.boundary_loops, 2);
  EXPECT_EQ(summary.genus, 0);
  EXPECT_NEAR(AreaOfFaces(mesh), std::numbers::pi * (0.25 - 0.04), 0.02);
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
    const ControlMesh mesh = TriangulateArea(board, edge, RunContext{}).value();
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
  EXPECT_EQ(Summary(TriangulateArea(islands, 0.05, RunContext{}).value()).components, 2);
}

TEST(TriangulateArea, GivesNothingForASpeck) {
  const OccupiedArea speck =
      Drawn([](double x, double y) { return std::hypot(x - 0.6, y - 0.6) < 0.02; });
  EXPECT_EQ(TriangulateArea(speck, 0.2, RunContext{}).value().faces.cols(), 0);
}

// Two islands far apart: the lattice around them has 10^9 places, of which 10^4 are used.
TEST(TriangulateArea, IslandsFarApartCostWhatTheyCover) {
  OccupiedArea area;
  area.cell = 0.01;
  area.columns = area.rows = 1000;
  area.inside.assign(1000000, 0);
  for (const int island : {100, 880}) {
    for (int r = 0; r < 2; ++r) {
      for (int c = 0; c < 2; ++c) area.inside[(island + r) * 1000 + island + c] = 1;
    }
  }
  FillHoles(0, BoundaryRule::kKeep, &area);
  const double edge = 2e-4;
  const auto mesh = TriangulateArea(area, edge, RunContext{});
  ASSERT_TRUE(mesh.ok());
  const double faces = area.area() / (edge * edge * std::sqrt(3) / 4);
  // The border cuts the corners of such small squares: an eighth of their area.
  EXPECT_NEAR(static_cast<double>(mesh->faces.cols()), 0.885 * faces, 0.02 * faces);
  EXPECT_EQ(Summary(*mesh).components, 2);
}

TEST(TriangulateArea, Stops) {
  OccupiedArea area;
  area.cell = 0.1;
  area.columns = area.rows = 10;
  area.inside.assign(100, 1);
  FillHoles(0, BoundaryRule::kKeep, &area);
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(TriangulateArea(area, 0.05, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
