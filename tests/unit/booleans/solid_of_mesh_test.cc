#include "core/booleans/solid_of_mesh.h"

#include <gtest/gtest.h>

#include "tests/unit/booleans/solid_shapes.h"

namespace rilievo {
namespace {

PointCloud CloudOf(const TriangleMesh& mesh) {
  PointCloud cloud;
  cloud.points = mesh.vertices;
  cloud.triangles = mesh.triangles;
  return cloud;
}

// Far from 0, where the unit frame and back would round.
TEST(SolidOfMeshTest, VerticesStayBitForBit) {
  const TriangleMesh ball = Moved(SphereMesh(3), By(5e5, -3e6, 1. / 3));
  const auto solid = SolidOfMesh(CloudOf(ball), RunContext());
  ASSERT_TRUE(solid.ok());
  ASSERT_EQ(solid->triangles.cols(), ball.triangles.cols());
  for (Eigen::Index i = 0; i < ball.triangles.size(); ++i) {
    EXPECT_EQ(Eigen::Vector3d(solid->vertices.col(solid->triangles.data()[i])),
              Eigen::Vector3d(ball.vertices.col(ball.triangles.data()[i])));
  }
}

TEST(SolidOfMeshTest, ASoupOfTrianglesIsJoinedAndFacesOutwards) {
  const TriangleMesh box = InsideOut(UnitBox(2, 3, 4));
  PointCloud soup;
  soup.points.resize(3, 36);
  soup.triangles.resize(3, 12);
  for (int i = 0; i < 36; ++i) {
    soup.points.col(i) = box.vertices.col(box.triangles(i % 3, i / 3));
    soup.triangles(i % 3, i / 3) = i;
  }
  soup.triangles.col(4).reverseInPlace();
  const auto solid = SolidOfMesh(soup, RunContext());
  ASSERT_TRUE(solid.ok());
  EXPECT_EQ(solid->vertices.cols(), 8);
  const TopologySummary summary = SummarizeTopology(solid->triangles, 8);
  EXPECT_TRUE(summary.closed() && summary.oriented);
  EXPECT_NEAR(VolumeOf(*solid), 1, 1e-9);
}

TEST(SolidOfMeshTest, SolidsGluedAtAWholeFaceAreOne) {
  for (const bool askew : {false, true}) {
    const Eigen::Affine3d pose = askew ? Askew() : Eigen::Affine3d::Identity();
    const TriangleMesh row =
        Together(Together(UnitBox(0, 0, 0), UnitBox(1, 0, 0)), UnitBox(2, 0, 0));
    const auto solid = SolidOfMesh(CloudOf(Moved(row, pose)), RunContext());
    ASSERT_TRUE(solid.ok()) << solid.status();
    const TopologySummary summary =
        SummarizeTopology(solid->triangles, static_cast<int>(solid->vertices.cols()));
    EXPECT_TRUE(summary.closed() && summary.manifold());
    EXPECT_EQ(summary.components, 1);
    EXPECT_EQ(solid->triangles.cols(), 28);
    EXPECT_NEAR(VolumeOf(*solid), 3, 1e-9);
  }
}

TEST(SolidOfMeshTest, ASheetOfTwoSidesIsNoSolid) {
  const TriangleMesh box = UnitBox(0, 0, 0);
  const auto solid = SolidOfMesh(CloudOf(Together(box, InsideOut(box))), RunContext());
  EXPECT_EQ(solid.status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(SolidOfMeshTest, NoTrianglesIsRefused) {
  PointCloud points;
  points.points.setRandom(3, 30);
  EXPECT_EQ(SolidOfMesh(points, RunContext()).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
