#include "core/control/simplify/uncovered_points.h"

#include <gtest/gtest.h>

#include <stop_token>

#include "core/control/simplify/simplify_mesh.h"
#include "tests/unit/control/pronged_ball.h"
#include "tests/unit/loop/crease_meshes.h"

namespace rilievo {
namespace {

ControlMesh Coarse(const ControlMesh& fine, int faces) {
  return SimplifyMesh(fine, SimplifyOptions{.target_faces = faces}, RunContext()).value();
}

constexpr CoverageLimits kLimits = {.spacings = 1, .noises = 4, .cosine = 0.3};

absl::StatusOr<UncoveredPoints> Find(const OrientedCloud& cloud, const ControlMesh& control,
                                     const RunContext& context = {}) {
  return FindUncoveredPoints(cloud, control, kLimits, context);
}

TEST(UncoveredPointsTest, HeightsReachAllOfASmoothSurface) {
  const ControlMesh fine = MarchTetrahedra(SphereField, 40);
  const auto lost = Find(CloudOf(fine), Coarse(fine, 200));
  ASSERT_TRUE(lost.ok());
  EXPECT_TRUE(lost->points.empty());
  EXPECT_EQ(lost->faces, 0);
}

TEST(UncoveredPointsTest, WhatACoarseMeshCutOffIsOutOfReach) {
  const ControlMesh fine = MarchTetrahedra(ProngedBallField, 80);
  const OrientedCloud cloud = CloudOf(fine);
  const ControlMesh coarse = Coarse(MarchTetrahedra(BallField, 80), 200);
  const auto lost = Find(cloud, coarse);
  ASSERT_TRUE(lost.ok());
  EXPECT_GT(lost->points.size(), 50);
  EXPECT_GT(lost->faces, 0);
  EXPECT_LT(lost->faces, 30);
  for (const auto& point : lost->points) EXPECT_GT(BallField(point), 0.01) << point.transpose();
}

TEST(UncoveredPointsTest, WhatNoiseMayHaveMadeIsInReach) {
  OrientedCloud cloud = CloudOf(MarchTetrahedra(ProngedBallField, 80));
  cloud.median_noise = 0.1;
  const ControlMesh coarse = Coarse(MarchTetrahedra(BallField, 80), 200);
  EXPECT_TRUE(Find(cloud, coarse)->points.empty());
}

TEST(UncoveredPointsTest, ASteeperRuleFindsMore) {
  const OrientedCloud cloud = CloudOf(MarchTetrahedra(ProngedBallField, 80));
  const ControlMesh coarse = Coarse(MarchTetrahedra(BallField, 80), 200);
  CoverageLimits limits = kLimits;
  const auto with = [&](const CoverageLimits& rule) {
    return FindUncoveredPoints(cloud, coarse, rule, {})->points.size();
  };
  const size_t few = with(limits);
  limits.cosine = 0.9;
  EXPECT_GT(with(limits), few);
  limits.spacings = 20;
  EXPECT_LT(with(limits), few);
}

// Past the edges of the smaller cube both sides' triangles are as near to a point.
TEST(UncoveredPointsTest, AnEdgeFacesAsEitherSideDoes) {
  constexpr int kRow = 40;
  constexpr double kHalf = 1.06;
  OrientedCloud cloud;
  cloud.points.resize(3, 6 * kRow * kRow);
  cloud.normals.setZero(3, cloud.points.cols());
  for (int k = 0; k < cloud.points.cols(); ++k) {
    const int side = k / (kRow * kRow), axis = side / 2;
    const double outward = side % 2 == 0 ? 1 : -1;
    const auto along = [&](int step) { return kHalf * (2.0 * (step % kRow) / (kRow - 1) - 1); };
    cloud.points(axis, k) = outward * kHalf;
    cloud.points((axis + 1) % 3, k) = along(k);
    cloud.points((axis + 2) % 3, k) = along(k / kRow);
    cloud.normals(axis, k) = outward;
  }
  cloud.median_spacing = 0.05;
  cloud.spacing.assign(cloud.points.cols(), 0.05f);
  cloud.noise.assign(cloud.points.cols(), 0.0f);
  const CoverageLimits limits = {.spacings = 1, .noises = 1, .cosine = 0.9};
  const auto lost = FindUncoveredPoints(cloud, testing::SharpCube(), limits, {});
  ASSERT_TRUE(lost.ok());
  EXPECT_EQ(lost->points.size(), 0);
  cloud.normals = -cloud.normals;  // none but faces away, and is farther off than a spacing
  const auto away = FindUncoveredPoints(cloud, testing::SharpCube(), limits, {});
  EXPECT_GT(away->points.size(), 100);
}

TEST(UncoveredPointsTest, OnePointAloneMayBeNoise) {
  const ControlMesh fine = MarchTetrahedra(SphereField, 40);
  OrientedCloud cloud = CloudOf(fine);
  const ControlMesh coarse = Coarse(fine, 2000);  // so many that every point is asked
  cloud.points.col(100) += 6 * cloud.median_spacing * cloud.normals.col(100);
  cloud.normals.col(100) = cloud.normals.col(100).unitOrthogonal().eval();
  EXPECT_EQ(Find(cloud, coarse)->points.size(), 1);
  cloud.median_noise = 0.3 * cloud.median_spacing;
  EXPECT_EQ(Find(cloud, coarse)->points.size(), 0);
  cloud.points.col(101) = cloud.points.col(100);
  cloud.normals.col(101) = cloud.normals.col(100);
  EXPECT_EQ(Find(cloud, coarse)->points.size(), 2);
}

TEST(UncoveredPointsTest, ThreadsDoNotMatterAndStopsAreHeard) {
  const OrientedCloud cloud = CloudOf(MarchTetrahedra(ProngedBallField, 80));
  const ControlMesh coarse = Coarse(MarchTetrahedra(BallField, 80), 200);
  RunContext context;
  context.threads = 1;
  const auto one = Find(cloud, coarse, context);
  context.threads = 4;
  const auto four = Find(cloud, coarse, context);
  EXPECT_EQ(one->points, four->points);
  std::stop_source source;
  source.request_stop();
  context.stop = source.get_token();
  EXPECT_EQ(Find(cloud, coarse, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
