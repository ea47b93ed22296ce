#include "core/meshes/split_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "core/geometry/mesh_topology.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

double AreaOf(const ControlMesh& mesh) {
  double sum = 0;
  for (const auto face : mesh.faces.colwise()) {
    sum += (mesh.vertices.col(face[1]) - mesh.vertices.col(face[0]))
               .cross(mesh.vertices.col(face[2]) - mesh.vertices.col(face[0]))
               .norm();
  }
  return sum / 2;
}

double LongestEdge(const ControlMesh& mesh) {
  double longest = 0;
  for (const auto face : mesh.faces.colwise()) {
    for (int k = 0; k < 3; ++k) {
      longest = std::max(
          longest, (mesh.vertices.col(face[k]) - mesh.vertices.col(face[(k + 1) % 3])).norm());
    }
  }
  return longest;
}

int WidestFan(const ControlMesh& mesh) {
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  EXPECT_TRUE(topology.ok()) << topology.status();
  return topology.ok() ? *std::max_element(topology->valence.begin(), topology->valence.end()) : 0;
}

TEST(SplitEdgesTest, NoEdgeIsLongerAndTheShapeStays) {
  testing::Random random(3);
  const ControlMesh mesh = testing::Perturbed(testing::Torus(9, 7), 0.1, random);
  const ControlMesh split = SplitLongEdges(mesh, 0.11, 1 << 20, RunContext{}).value();
  EXPECT_LE(LongestEdge(split), 0.11);
  EXPECT_NEAR(AreaOf(split), AreaOf(mesh), 1e-12 * AreaOf(mesh));
  const TopologySummary summary =
      SummarizeTopology(split.faces, static_cast<int>(split.vertices.cols()));
  EXPECT_EQ(summary.genus, 1);
  EXPECT_TRUE(summary.manifold());
  EXPECT_TRUE(summary.oriented);
}

TEST(SplitEdgesTest, ShortEdgesStay) {
  const ControlMesh mesh = testing::Icosahedron();
  EXPECT_EQ(SplitLongEdges(mesh, 10, 1 << 20, RunContext{}).value().faces, mesh.faces);
}

// Flat: a vertex in the middle of a regular polygon, or at the middle of a half one.
TEST(SplitEdgesTest, AWideFanGetsRings) {
  for (const int faces : {65, 200, 5001}) {
    for (const bool is_closed : {true, false}) {
      ControlMesh fan = is_closed ? testing::Bipyramid(faces) : testing::HalfFan(faces);
      const double area = AreaOf(fan);
      const ControlMesh split = SplitLongEdges(fan, 1e9, 1 << 20, RunContext{}).value();
      EXPECT_LE(WidestFan(split), 65) << faces;
      // The rings cut corners of the shape, the more the fewer faces there were.
      EXPECT_NEAR(AreaOf(split) / area, 1, 0.01) << faces;
      EXPECT_LT(split.faces.cols(), 4 * fan.faces.cols());
      EXPECT_EQ(SummarizeTopology(split.faces, static_cast<int>(split.vertices.cols())).closed(),
                is_closed);
    }
  }
}

TEST(SplitEdgesTest, NeedlesHaveFewPieces) {
  ControlMesh needles = testing::Icosahedron();
  needles.vertices.topRows(2) *= 1e-9;
  const ControlMesh split = SplitLongEdges(needles, 1e-9, 1000, RunContext{}).value();
  EXPECT_GT(split.faces.cols(), 500);
  EXPECT_LT(split.faces.cols(), 8000);
}

TEST(SplitEdgesTest, GivenEdgesAreHalvedWithoutGaps) {
  testing::Random random(5);
  ControlMesh mesh = testing::Perturbed(testing::Grid(6, 5), 0.1, random);
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  std::vector<std::array<int, 2>> border;
  for (int e = 0; e < topology->edge_count(); ++e) {
    const int a = topology->edge_vertices(0, e), b = topology->edge_vertices(1, e);
    if (topology->edge_faces(1, e) < 0) {
      border.push_back({b, a});
    } else {
      mesh.creases.push_back({std::min(a, b), std::max(a, b), 2.5F});
    }
  }
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& x, const Crease& y) {
    return std::pair(x.a, x.b) < std::pair(y.a, y.b);
  });
  mesh.corners = {0};
  const ControlMesh halved = HalveEdges(mesh, border);
  const TopologySummary summary =
      SummarizeTopology(halved.faces, static_cast<int>(halved.vertices.cols()));
  EXPECT_TRUE(summary.manifold() && summary.oriented);
  EXPECT_EQ(summary.euler, 1);
  EXPECT_EQ(summary.boundary_edges, 2 * static_cast<int64_t>(border.size()));
  EXPECT_LT(halved.faces.cols(), 4 * mesh.faces.cols());
  EXPECT_NEAR(AreaOf(halved), AreaOf(mesh), 1e-12);
  EXPECT_EQ(halved.corners, mesh.corners);
  const auto length = [](const ControlMesh& of) {
    double sum = 0;
    for (const Crease& crease : of.creases) {
      EXPECT_EQ(crease.sharpness, 2.5F);
      sum += (of.vertices.col(crease.a) - of.vertices.col(crease.b)).norm();
    }
    return sum;
  };
  EXPECT_NEAR(length(halved), length(mesh), 1e-12);
}

TEST(SplitEdgesTest, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  EXPECT_EQ(SplitLongEdges(testing::Torus(9, 7), 0.01, 1 << 20, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
