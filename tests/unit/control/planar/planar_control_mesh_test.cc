#include "core/control/planar/planar_control_mesh.h"

#include <gtest/gtest.h>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

Eigen::Isometry3d Pose() {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.rotate(Eigen::AngleAxisd(0.8, Vector3d(2, -1, 0.5).normalized()));
  return pose;
}

absl::StatusOr<ControlMesh> Planar(const OrientedCloud& cloud, BoundaryRule boundary,
                                   int target_faces, const RunContext& context = RunContext()) {
  return PlanarControlMesh(cloud, boundary, target_faces, context);
}

TEST(PlanarControlMesh, FollowsATerrainAndKeepsItsHole) {
  const OrientedCloud cloud = TerrainCloud(20000, 0.12, Pose());
  const auto mesh = Planar(cloud, BoundaryRule::kKeep, 1000);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  const TopologySummary summary = Summary(*mesh);
  EXPECT_TRUE(summary.manifold());
  EXPECT_EQ(summary.components, 1);
  EXPECT_EQ(summary.boundary_loops, 2);
  EXPECT_NEAR(static_cast<double>(mesh->faces.cols()), 1000, 100);
  const Eigen::Matrix3Xd flat = Pose().inverse() * mesh->vertices;
  for (const auto& x : flat.colwise()) {
    EXPECT_NEAR(x.z(), WavyHeight(x.x(), x.y()), 0.004);
    EXPECT_GT(std::hypot(x.x() - 0.1, x.y() - 0.05), 0.09);
    EXPECT_LT(x.head<2>().cwiseAbs().maxCoeff(), 0.37);
  }
  for (const auto& face : mesh->faces.colwise()) {
    const Vector3d a = flat.col(face[0]), b = flat.col(face[1]), c = flat.col(face[2]);
    EXPECT_GT((b - a).cross(c - a).z(), 0);
  }
}

TEST(PlanarControlMesh, ReachesTheBorderOfTheScan) {
  const OrientedCloud cloud = TerrainCloud(20000, 0.12);
  const auto mesh = Planar(cloud, BoundaryRule::kKeep, 1000);
  ASSERT_TRUE(mesh.ok());
  EXPECT_NEAR(mesh->vertices.row(0).maxCoeff(), 0.35, 0.01);
  EXPECT_NEAR(mesh->vertices.row(0).minCoeff(), -0.35, 0.01);
  EXPECT_NEAR(mesh->vertices.row(1).maxCoeff(), 0.35, 0.01);
  EXPECT_NEAR(mesh->vertices.row(1).minCoeff(), -0.35, 0.01);
}

TEST(PlanarControlMesh, CloseFillsTheHoleSmoothly) {
  const auto mesh = Planar(TerrainCloud(20000, 0.12), BoundaryRule::kClose, 1000);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(Summary(*mesh).boundary_loops, 1);
  EXPECT_LT(mesh->vertices.row(2).cwiseAbs().maxCoeff(), 0.05);
  int in_hole = 0;
  for (const auto& x : mesh->vertices.colwise()) {
    in_hole += std::hypot(x.x() - 0.1, x.y() - 0.05) < 0.1 ? 1 : 0;
  }
  EXPECT_GT(in_hole, 10);
}

TEST(PlanarControlMesh, IsTheSameForAnyThreadCount) {
  const OrientedCloud cloud = TerrainCloud(5000, 0.1);
  RunContext one, two;
  one.threads = 1;
  two.threads = 2;
  const auto a = Planar(cloud, BoundaryRule::kKeep, 400, one);
  const auto b = Planar(cloud, BoundaryRule::kKeep, 400, two);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->faces, b->faces);
  EXPECT_EQ(a->vertices, b->vertices);
}

TEST(PlanarControlMesh, RefusesASphereAndNamesTheRoad) {
  const auto mesh = Planar(SphereCloud(8000), BoundaryRule::kKeep, 400);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_NE(mesh.status().message().find("arbitrary would serve"), absl::string_view::npos);
}

TEST(PlanarControlMesh, Stops) {
  EXPECT_EQ(Planar(TerrainCloud(500, 0), BoundaryRule::kKeep, 100, Stopped()).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
