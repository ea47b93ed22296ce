// A mesh in, a surface of its topology out: the real pipeline behind the real program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/library/jobs_client.h"
#include "client/library/reconstruction_client.h"
#include "core/codec/container/dss.h"
#include "core/geometry/mesh_topology.h"
#include "core/surface/displaced_surface.h"
#include "tests/integration/daemon/daemon_process.h"
#include "tests/unit/domain/analytic_scenes.h"
#include "tests/unit/server/store/test_folder.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

class MeshesTest : public testing::Test {
 protected:
  ReconstructionClient Client() const {
    return ReconstructionClient(ConnectPlaintext(daemon_.address()));
  }

  TestFolder test_;
  DaemonProcess daemon_{{"--store", test_ / "store"}};
};

PointCloud AsMesh(ControlMesh mesh) {
  return {.points = std::move(mesh.vertices), .triangles = std::move(mesh.faces)};
}

TriangleMesh FinestOf(const std::vector<uint8_t>& dss) {
  const auto decoded = DecodeDss(dss, {});
  EXPECT_TRUE(decoded.ok()) << decoded.status();
  if (!decoded.ok()) return {};
  const auto mesh = Tessellate(decoded->surface, decoded->surface.max_level, {});
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *mesh : TriangleMesh{};
}

TopologySummary TopologyOfMesh(const TriangleMesh& mesh) {
  return SummarizeTopology(mesh.triangles, static_cast<int>(mesh.vertices.cols()));
}

TEST_F(MeshesTest, ASphereStaysASphere) {
  const auto result = Client().Reconstruct(AsMesh(OctahedralSphere(1, 5)), {});
  ASSERT_TRUE(result.ok()) << result.status();
  const TriangleMesh mesh = FinestOf(result->dss);
  const TopologySummary topology = TopologyOfMesh(mesh);
  EXPECT_TRUE(topology.manifold());
  EXPECT_TRUE(topology.closed());
  EXPECT_EQ(topology.euler, 2);
  // Its triangles lie up to 0.002 below the sphere; the diagonal is 2 sqrt(3).
  EXPECT_LT((mesh.vertices.colwise().norm().array() - 1).abs().maxCoeff(), 0.005);
  const v1::ReconstructReport& report = result->report;
  EXPECT_EQ(report.mesh().triangles(), 8192);
  EXPECT_EQ(report.mesh().triangles_used(), 8192);
  EXPECT_EQ(report.mesh().flipped(), 0);
  EXPECT_EQ(report.genus(), 0);
}

TEST_F(MeshesTest, ATorusKeepsItsHoleAlsoAsAKeptJob) {
  const PointCloud torus = AsMesh(TorusMesh(1, 0.4, 80, 40));
  const auto result = Client().Reconstruct(torus, {});
  ASSERT_TRUE(result.ok()) << result.status();
  const TriangleMesh mesh = FinestOf(result->dss);
  const TopologySummary topology = TopologyOfMesh(mesh);
  EXPECT_TRUE(topology.manifold());
  EXPECT_TRUE(topology.closed());
  EXPECT_EQ(topology.genus, 1);
  EXPECT_EQ(result->report.genus(), 1);
  for (const auto& vertex : mesh.vertices.colwise()) {
    const double from_ring = std::hypot(vertex.head<2>().norm() - 1, vertex.z());
    ASSERT_NEAR(from_ring, 0.4, 0.01);
  }

  const JobsClient jobs(ConnectPlaintext(daemon_.address()));
  const auto job = jobs.Submit(PackScan(torus), {}, "torus");
  ASSERT_TRUE(job.ok()) << job.status();
  const auto done = jobs.Watch(job->job_id());
  ASSERT_TRUE(done.ok()) << done.status();
  ASSERT_EQ(done->state(), v1::JOB_STATE_SUCCEEDED) << done->error().message();
  EXPECT_EQ(done->report().mesh().triangles(), 6400);
  EXPECT_EQ(*jobs.Fetch(job->job_id()), result->dss);
}

TEST_F(MeshesTest, ABorderStaysABorder) {
  const auto result = Client().Reconstruct(AsMesh(OctahedralSphere(1, 5, /*upper_half=*/true)), {});
  ASSERT_TRUE(result.ok()) << result.status();
  const TopologySummary topology = TopologyOfMesh(FinestOf(result->dss));
  EXPECT_TRUE(topology.manifold());
  EXPECT_EQ(topology.boundary_loops, 1);
  EXPECT_EQ(topology.genus, 0);
  EXPECT_EQ(result->report.boundary_loops(), 1);
}

TEST_F(MeshesTest, ColoursOfTheVerticesComeToTheSurface) {
  PointCloud sphere = AsMesh(OctahedralSphere(1, 4));
  sphere.sights.colors.assign(static_cast<size_t>(sphere.points.cols()), Rgb{200, 100, 50});
  const auto result = Client().Reconstruct(sphere, {});
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_GT(result->report.colors().bytes(), 0);
}

TEST_F(MeshesTest, TrianglesThatAreNoneNameTheirNumber) {
  PointCloud sphere = AsMesh(OctahedralSphere(1, 3));
  for (const int corner : {static_cast<int>(sphere.points.cols()), -1}) {
    sphere.triangles(1, 77) = corner;
    const auto result = Client().Reconstruct(sphere, {});
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(result.status().message()), HasSubstr("triangles: "));
    EXPECT_THAT(std::string(result.status().message()), HasSubstr("77"));
  }
  sphere.points.setZero();
  sphere.triangles(1, 77) = 0;
  const auto result = Client().Reconstruct(sphere, {});
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(result.status().message()), HasSubstr("triangles: "));
}

}  // namespace
}  // namespace rilievo
