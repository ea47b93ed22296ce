#include "core/codec/mesh/control_mesh_coder.h"

#include "core/codec/mesh/prepare_control_mesh.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

std::vector<GridPoint> Grid(const ControlMesh& mesh, double step) {
  std::vector<GridPoint> points(mesh.vertices.cols());
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      points[v][axis] = static_cast<int32_t>(std::nearbyint(mesh.vertices(axis, v) / step));
    }
  }
  return points;
}

// A sheet folded into handles: quads joined at random places by tubes, so that the walk splits and
// joins its border many times.
ControlMesh HighGenus() {
  ControlMesh mesh = Torus(12, 6);
  for (int i = 1; i < 4; ++i) mesh = Together(mesh, Torus(12, 6), {0.9 * i, 0, 0});
  // Tubes between faces of neighbouring tori and within one torus: two faces are taken out and
  // their rims joined by six triangles.
  std::vector<Eigen::Vector3i> faces;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) faces.push_back(mesh.faces.col(f));
  const std::vector<std::pair<int, int>> tubes = {{3, 147},   {150, 300}, {310, 450}, {20, 120},
                                                  {170, 260}, {320, 410}, {470, 560}, {40, 90}};
  std::vector<uint8_t> gone(faces.size(), 0);
  std::vector<Eigen::Vector3i> rims;
  for (const auto& [a, b] : tubes) {
    gone[a] = gone[b] = 1;
    const Eigen::Vector3i p = faces[a], q(faces[b][0], faces[b][2], faces[b][1]);
    for (int k = 0; k < 3; ++k) {
      const int n = (k + 1) % 3;
      rims.push_back({p[k], p[n], q[k]});
      rims.push_back({p[n], q[n], q[k]});
    }
  }
  std::vector<Eigen::Vector3i> kept = rims;
  for (size_t f = 0; f < faces.size(); ++f) {
    if (gone[f] == 0) kept.push_back(faces[f]);
  }
  mesh.faces.resize(3, static_cast<Eigen::Index>(kept.size()));
  for (size_t f = 0; f < kept.size(); ++f) mesh.faces.col(static_cast<Eigen::Index>(f)) = kept[f];
  return mesh;
}

void ExpectRoundTrip(const ControlMesh& mesh, double step) {
  const auto canonical = CanonicalControlMesh(mesh);
  ASSERT_TRUE(canonical.ok()) << canonical.status();
  const int vertex_count = static_cast<int>(canonical->vertices.cols());
  const MeshTopology topology = *BuildMeshTopology(canonical->faces, vertex_count);
  const std::vector<GridPoint> points = Grid(*canonical, step);
  const auto bytes = EncodeControlMesh(topology, points, SeedBits(step));
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const auto decoded = DecodeControlMesh(*bytes, vertex_count, topology.face_count(),
                                         topology.face_neighbors.minCoeff() < 0, SeedBits(step));
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->points, points);
  EXPECT_EQ(decoded->faces, canonical->faces);
}

TEST(ControlMeshCoderTest, RoundTripsManyHandles) {
  const ControlMesh mesh = HighGenus();
  const TopologySummary summary =
      SummarizeTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  ASSERT_TRUE(summary.manifold() && summary.closed() && summary.oriented);
  ASSERT_EQ(summary.components, 1);
  // Four tori; of eight tubes three join the tori to one piece and five are handles.
  ASSERT_EQ(summary.genus, 9);
  for (uint64_t seed = 0; seed < 20; ++seed) ExpectRoundTrip(Shuffled(mesh, seed), 1e-4);
}

TEST(ControlMeshCoderTest, RoundTripsManyHoles) {
  ControlMesh mesh = Sheet(20, 20, false);
  Eigen::Matrix3Xi kept(3, mesh.faces.cols());
  int count = 0;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    // Every ninth quad of every third row is a hole; no two touch.
    const int row = static_cast<int>(f / 2) / 19, column = static_cast<int>(f / 2) % 19;
    if (row % 3 == 1 && column % 3 == 1) continue;
    kept.col(count++) = mesh.faces.col(f);
  }
  mesh.faces = kept.leftCols(count);
  for (uint64_t seed = 0; seed < 20; ++seed) ExpectRoundTrip(Shuffled(mesh, seed), 1e-4);
}

TEST(ControlMeshCoderTest, RoundTripsWhateverThePointsAre) {
  ControlMesh mesh = Torus(9, 7);
  mesh.vertices.setZero();
  ExpectRoundTrip(mesh, 1e-4);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      mesh.vertices(axis, v) = MixedBits(3 * v + axis) % 2 == 0 ? kMaxCoordinate : -kMaxCoordinate;
    }
  }
  ExpectRoundTrip(mesh, 1);
}

TEST(ControlMeshCoderTest, SeedBitsAreThoseOfTheUnitFrame) {
  EXPECT_EQ(SeedBits(1), 1);
  EXPECT_EQ(SeedBits(0.25), 2);     // +-0.5 in quarters: 2
  EXPECT_EQ(SeedBits(1e-4), 13);    // 5000 < 2^13
  EXPECT_EQ(SeedBits(1e-300), 28);  // the range of the format
}

// Positions on a grid of a twentieth of an edge, connectivity and all: about 20 bits a vertex for a
// mesh whose vertices stray by a quarter of an edge.
TEST(ControlMeshCoderTest, IrregularMeshesTakeTwentyBitsAVertex) {
  ControlMesh mesh = Torus(60, 30);
  const double edge = (mesh.vertices.col(1) - mesh.vertices.col(0)).norm();
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    for (int axis = 0; axis < 3; ++axis) {
      mesh.vertices(axis, v) += edge / 4 * MixedUnit(3 * v + axis);
    }
  }
  const ControlMesh canonical = *CanonicalControlMesh(mesh);
  const MeshTopology topology = *BuildMeshTopology(canonical.faces, 1800);
  const double step = edge / 20;
  const auto bytes = *EncodeControlMesh(topology, Grid(canonical, step), SeedBits(step));
  EXPECT_LT(8.0 * bytes.size() / 1800, 20);
}

// A regular mesh says little: well under half a bit a vertex for connectivity and three zeros, once
// learned.
TEST(ControlMeshCoderTest, RegularConnectivityIsNearlyFree) {
  ControlMesh mesh = *CanonicalControlMesh(Torus(60, 50));
  const MeshTopology topology = *BuildMeshTopology(mesh.faces, 3000);
  const std::vector<GridPoint> nowhere(3000, GridPoint{0, 0, 0});
  EXPECT_LT(8.0 * EncodeControlMesh(topology, nowhere, 13)->size() / 3000, 0.4);
}

TEST(ControlMeshCoderTest, RefusesAnotherOrder) {
  const ControlMesh mesh = Shuffled(*CanonicalControlMesh(Torus(9, 7)), 4);
  const MeshTopology topology = *BuildMeshTopology(mesh.faces, 63);
  EXPECT_EQ(EncodeControlMesh(topology, Grid(mesh, 1e-4), 13).status().code(),
            absl::StatusCode::kInvalidArgument);
}

TEST(ControlMeshCoderTest, CutBytesAreDataLoss) {
  const ControlMesh mesh = *CanonicalControlMesh(Torus(9, 7));
  const MeshTopology topology = *BuildMeshTopology(mesh.faces, 63);
  const std::vector<uint8_t> bytes = *EncodeControlMesh(topology, Grid(mesh, 1e-4), 13);
  for (size_t size = 0; size + 10 < bytes.size(); ++size) {
    const auto decoded = DecodeControlMesh(std::span(bytes).first(size), 63, 126, false, 13);
    EXPECT_EQ(decoded.status().code(), absl::StatusCode::kDataLoss) << size;
  }
}

}  // namespace
}  // namespace rilievo
