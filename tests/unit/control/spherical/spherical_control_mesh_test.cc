#include "core/control/spherical/spherical_control_mesh.h"

#include <gtest/gtest.h>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

absl::StatusOr<ControlMesh> Spherical(const OrientedCloud& cloud, int target_faces,
                                      const RunContext& context = RunContext()) {
  return SphericalControlMesh(cloud, target_faces, context);
}

TEST(SphericalControlMesh, TheSeedsOwnCase) {
  const auto mesh = Spherical(StarCloud(9218), 8192);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->vertices.cols(), 4098);
  const TopologySummary summary = Summary(*mesh);
  EXPECT_TRUE(summary.manifold());
  EXPECT_TRUE(summary.closed());
  EXPECT_EQ(summary.genus, 0);
  double squares = 0;
  for (const auto& x : mesh->vertices.colwise()) {
    const double off = x.norm() - StarRadius(x.normalized());
    EXPECT_LT(std::abs(off), 0.01);
    squares += off * off;
  }
  EXPECT_LT(std::sqrt(squares / 4098), 0.002);
}

TEST(SphericalControlMesh, ASphereStaysOneWhereverItLies) {
  const Vector3d center(0.05, -0.1, 0.08);
  const auto mesh = Spherical(SphereCloud(20000, 0.28, center), 2000);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(mesh->faces.cols(), 2048);
  for (const auto& x : mesh->vertices.colwise()) EXPECT_NEAR((x - center).norm(), 0.28, 1e-3);
}

TEST(SphericalControlMesh, ClosesWhatTheScanLeftOpen) {
  const OrientedCloud whole = SphereCloud(20000);
  std::vector<int> kept;
  for (int i = 0; i < 20000; ++i) {
    if (whole.points(2, i) > -0.2) kept.push_back(i);
  }
  const OrientedCloud open =
      MakeCloud(whole.points(Eigen::all, kept), whole.normals(Eigen::all, kept));
  const auto mesh = Spherical(open, 2000);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_TRUE(Summary(*mesh).closed());
  for (const auto& x : mesh->vertices.colwise()) {
    EXPECT_GT(x.norm(), 0.1);
    EXPECT_LT(x.norm(), 0.4);
    if (x.z() > -0.15) {
      EXPECT_NEAR(x.norm(), 0.28, 0.005);
    }
  }
}

TEST(SphericalControlMesh, OutliersHaveNoSay) {
  OrientedCloud cloud = SphereCloud(20000);
  for (int i = 0; i < 20000; i += 50) cloud.points.col(i) *= 0.4;
  const auto mesh = Spherical(cloud, 512);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  for (const auto& x : mesh->vertices.colwise()) EXPECT_NEAR(x.norm(), 0.28, 0.01);
}

TEST(SphericalControlMesh, RefusesATorusAndATerrain) {
  for (const OrientedCloud& cloud : {TorusCloud(200, 80), TerrainCloud(8000, 0)}) {
    const auto mesh = Spherical(cloud, 2000);
    EXPECT_EQ(mesh.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_NE(mesh.status().message().find("arbitrary would serve"), absl::string_view::npos);
  }
}

TEST(SphericalControlMesh, Stops) {
  EXPECT_EQ(Spherical(SphereCloud(500), 100, Stopped()).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
