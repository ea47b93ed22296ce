// Points in, surface out: the real pipeline behind the real program on a real socket, checked
// against shapes whose distance is known exactly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "client/library/reconstruction_client.h"
#include "core/codec/container/dss.h"
#include "core/geometry/mesh_topology.h"
#include "core/pipeline/reconstruct.h"
#include "server/embedded_server.h"
#include "tests/integration/daemon/daemon_process.h"
#include "tests/integration/daemon/simulated_scans.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

class EndToEnd : public testing::Test {
 protected:
  ReconstructionClient Client() const {
    return ReconstructionClient(ConnectPlaintext(daemon_.address()));
  }

  DaemonProcess daemon_;
};

TriangleMesh Finest(const std::vector<uint8_t>& dss) {
  const auto decoded = DecodeDss(dss, {});
  EXPECT_TRUE(decoded.ok()) << decoded.status();
  if (!decoded.ok()) return {};
  const auto mesh = Tessellate(decoded->surface, decoded->surface.max_level, {});
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *mesh : TriangleMesh{};
}

TopologySummary TopologyOf(const TriangleMesh& mesh) {
  return SummarizeTopology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
}

TEST_F(EndToEnd, ASphereComesBackAsASphere) {
  const auto result = Client().Reconstruct(SphereScan(20'000), {});
  ASSERT_TRUE(result.ok()) << result.status();
  const TriangleMesh mesh = Finest(result->dss);
  const TopologySummary topology = TopologyOf(mesh);
  EXPECT_TRUE(topology.manifold());
  EXPECT_TRUE(topology.closed());
  EXPECT_EQ(topology.euler, 2);
  // A sphere of radius 1 has a diagonal of 2 sqrt(3): 0.1 % of it.
  EXPECT_LT((mesh.vertices.colwise().norm().array() - 1).abs().maxCoeff(), 0.0035);

  const v1::ReconstructReport& report = result->report;
  EXPECT_EQ(report.points_in(), 20'000);
  EXPECT_EQ(report.genus(), 0);
  EXPECT_EQ(report.components(), 1);
  EXPECT_NEAR(report.diagonal(), 2 * std::sqrt(3.0), 0.01);
  EXPECT_EQ(report.surface_vertices(), mesh.vertices.cols());
  EXPECT_EQ(report.encoded_bytes(), static_cast<int64_t>(result->dss.size()));
  // The points lie on the sphere; the way back is half their spacing and says nothing here.
  EXPECT_LT(report.error().points_to_surface().rms(), 2e-4);
  EXPECT_GT(report.error().surface_to_points().rms(), 0);
  EXPECT_FALSE(report.road_reason().empty());
  double stages = 0;
  for (const auto& time : report.stage_times()) stages += time.seconds();
  EXPECT_GT(stages, 0);
  EXPECT_LE(stages, report.total_seconds() * 1.01);
}

TEST_F(EndToEnd, ATorusKeepsItsHoleAndEveryPrefixOfChunksDecodes) {
  ScannerOptions scanner;
  scanner.points = 20'000;
  const ShapePtr torus = MakeTorus();
  const auto scan = SimulateScan(*torus, scanner);
  ASSERT_TRUE(scan.ok()) << scan.status();
  std::vector<uint8_t> arrived;
  std::vector<int64_t> ends;
  int levels_seen = 0;
  ReconstructCallbacks callbacks;
  callbacks.surface = [&](const v1::SurfaceHeader& header) {
    int64_t end = 0;
    for (const uint64_t bytes : header.chunk_bytes()) {
      ends.push_back(end += static_cast<int64_t>(bytes));
    }
  };
  callbacks.piece = [&](const v1::SurfacePiece& piece) {
    arrived.insert(arrived.end(), piece.data().begin(), piece.data().end());
    if (static_cast<int64_t>(arrived.size()) != ends.at(piece.chunk())) return;
    const auto decoded = DecodeDss(arrived, {});
    ASSERT_TRUE(decoded.ok()) << "after chunk " << piece.chunk() << ": " << decoded.status();
    ++levels_seen;
  };
  const auto result = Client().Reconstruct(scan->cloud, {}, callbacks);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(levels_seen, static_cast<int>(result->chunk_bytes.size()));
  EXPECT_GE(levels_seen, 3);
  const TriangleMesh mesh = Finest(result->dss);
  const TopologySummary topology = TopologyOf(mesh);
  EXPECT_TRUE(topology.manifold());
  EXPECT_EQ(topology.genus, 1);
  EXPECT_LT(MeasureAgainstShape(*torus, mesh.vertices).rms, 0.002 * torus->diagonal());
}

TEST_F(EndToEnd, MapCoordinatesLoseNothing) {
  const Eigen::Vector3d center(500'000.125, 4'600'000.25, 312.5);
  const auto near = Client().Reconstruct(SphereScan(5'000), {});
  const auto far = Client().Reconstruct(SphereScan(5'000, center), {});
  ASSERT_TRUE(near.ok()) << near.status();
  ASSERT_TRUE(far.ok()) << far.status();
  const TriangleMesh mesh = Finest(far->dss);
  const double near_worst =
      (Finest(near->dss).vertices.colwise().norm().array() - 1).abs().maxCoeff();
  const double far_worst =
      ((mesh.vertices.colwise() - center).colwise().norm().array() - 1).abs().maxCoeff();
  EXPECT_LT(far_worst, 1.5 * near_worst + 1e-4);
}

TEST_F(EndToEnd, TheSameBytesFromAnyThreadCountAndFromEachServer) {
  const PointCloud scan = SphereScan(8'000);
  v1::ReconstructOptions one, two;
  one.set_threads(1);
  two.set_threads(2);
  const auto first = Client().Reconstruct(scan, one);
  const auto second = Client().Reconstruct(scan, two);
  const auto embedded = EmbeddedServer::Start({});
  ASSERT_TRUE(embedded.ok()) << embedded.status();
  const auto third = ReconstructionClient((*embedded)->channel()).Reconstruct(scan, two);
  const auto direct = Reconstruct(scan, {}, {});
  ASSERT_TRUE(first.ok() && second.ok() && third.ok() && direct.ok());
  EXPECT_EQ(first->dss, second->dss);
  EXPECT_EQ(first->dss, third->dss);
  EXPECT_EQ(first->dss, direct->encoded.Concatenate());
}

TEST_F(EndToEnd, OptionsReachThePipeline) {
  v1::ReconstructOptions options;
  options.set_max_level(1);
  options.set_measure(false);
  options.mutable_control()->set_topology(v1::TOPOLOGY_SPHERICAL);
  options.mutable_fit()->set_method(v1::FIT_METHOD_SUZUKI);
  const auto result = Client().Reconstruct(SphereScan(5'000), options);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->report.max_level(), 1);
  EXPECT_EQ(result->report.road(), "spherical");
  EXPECT_FALSE(result->report.has_error());
  EXPECT_EQ(result->chunk_bytes.size(), 3u);
}

TEST_F(EndToEnd, AWordLeftUnspecifiedIsTheDefault) {
  ScannerOptions scanner;
  scanner.points = 6'000;
  const auto scan = SimulateScan(*MakeCutBox(), scanner);
  ASSERT_TRUE(scan.ok()) << scan.status();
  v1::ReconstructOptions unset, unspecified, automatic, off;
  for (v1::ReconstructOptions* options : {&unset, &unspecified, &automatic, &off}) {
    options->mutable_control()->set_topology(v1::TOPOLOGY_ARBITRARY);
  }
  unspecified.mutable_control()->set_boundary(v1::BOUNDARY_UNSPECIFIED);
  unspecified.mutable_control()->set_creases(v1::CREASES_UNSPECIFIED);
  unspecified.mutable_fit()->set_method(v1::FIT_METHOD_UNSPECIFIED);
  automatic.mutable_control()->set_creases(v1::CREASES_AUTO);
  off.mutable_control()->set_creases(v1::CREASES_OFF);
  const auto bytes = [&](const v1::ReconstructOptions& options) {
    const auto result = Client().Reconstruct(scan->cloud, options);
    EXPECT_TRUE(result.ok()) << result.status();
    return result.ok() ? result->dss : std::vector<uint8_t>();
  };
  const std::vector<uint8_t> expected = bytes(unset);
  EXPECT_EQ(bytes(unspecified), expected);
  EXPECT_EQ(bytes(automatic), expected);
  EXPECT_NE(bytes(off), expected);
}

// An octahedron in the scan's own frame, far from the origin.
v1::ControlMesh Octahedron(const Eigen::Vector3d& center) {
  v1::ControlMesh mesh;
  for (const Eigen::Vector3d& corner :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 1, 0),
        Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)}) {
    const Eigen::Vector3d position = center + 1.3 * corner;
    mesh.mutable_positions()->append(reinterpret_cast<const char*>(position.data()), 24);
  }
  for (const uint32_t v :
       {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5}) {
    mesh.add_faces(v);
  }
  return mesh;
}

TEST_F(EndToEnd, AControlMeshOfTheUserIsUsedInTheScansFrame) {
  const Eigen::Vector3d center(1000, -2000, 50);
  v1::ReconstructOptions options;
  options.set_max_level(4);
  *options.mutable_control()->mutable_control_mesh() = Octahedron(center);
  const auto result = Client().Reconstruct(SphereScan(5'000, center), options);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->report.road(), "user");
  EXPECT_EQ(result->report.control_faces(), 8);
  const TriangleMesh mesh = Finest(result->dss);
  EXPECT_EQ(mesh.triangles.cols(), 8 * 256);
  EXPECT_LT(((mesh.vertices.colwise() - center).colwise().norm().array() - 1).abs().maxCoeff(),
            0.02);
}

TEST_F(EndToEnd, AControlMeshThatIsNoManifoldNamesItsField) {
  v1::ReconstructOptions options;
  auto* mesh = options.mutable_control()->mutable_control_mesh();
  *mesh = Octahedron(Eigen::Vector3d::Zero());
  mesh->add_faces(0);  // a third face at an edge
  mesh->add_faces(2);
  mesh->add_faces(3);
  const auto result = Client().Reconstruct(SphereScan(1'000), options);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(result.status().message()),
              HasSubstr("header.options.control.control_mesh"));
}

TEST_F(EndToEnd, DegenerateScansAreRefusedWithAReason) {
  PointCloud scan = SphereScan(100);
  scan.points.colwise() = Eigen::Vector3d(1, 2, 3);
  const auto identical = Client().Reconstruct(scan, {});
  EXPECT_EQ(identical.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(identical.status().message()), HasSubstr("points: "));

  for (int i = 0; i < 100; ++i) scan.points.col(i) = i * Eigen::Vector3d(1, -2, 0.5);
  EXPECT_EQ(Client().Reconstruct(scan, {}).status().code(), absl::StatusCode::kInvalidArgument);

  scan.points.setConstant(std::nan(""));
  EXPECT_EQ(Client().Reconstruct(scan, {}).status().code(), absl::StatusCode::kInvalidArgument);

  // And the server still serves.
  EXPECT_TRUE(Client().Reconstruct(SphereScan(1'000), {}).ok());
}

TEST_F(EndToEnd, NonFinitePointsAreDroppedAndCounted) {
  PointCloud scan = SphereScan(3'000);
  scan.points(0, 7) = std::nan("");
  scan.points(1, 8) = -std::numeric_limits<double>::infinity();
  const auto result = Client().Reconstruct(scan, {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->report.non_finite(), 2);
}

}  // namespace
}  // namespace rilievo
