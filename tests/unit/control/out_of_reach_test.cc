#include "core/control/out_of_reach.h"

#include <gtest/gtest.h>

#include <stop_token>

#include "core/control/simplify_mesh.h"
#include "tests/unit/control/pronged_ball.h"

namespace rilievo {
namespace {

ControlMesh Coarse(const ControlMesh& fine, int faces) {
  return SimplifyMesh(fine, SimplifyOptions{.target_faces = faces}, RunContext()).value();
}

TEST(OutOfReachTest, HeightsReachAllOfASmoothSurface) {
  const ControlMesh fine = MarchTetrahedra(SphereField, 40);
  const auto lost = FindOutOfReach(CloudOf(fine), Coarse(fine, 200), RunContext());
  ASSERT_TRUE(lost.ok());
  EXPECT_TRUE(lost->points.empty());
  EXPECT_EQ(lost->faces, 0);
}

TEST(OutOfReachTest, WhatACoarseMeshCutOffIsOutOfReach) {
  const ControlMesh fine = MarchTetrahedra(ProngedBallField, 80);
  const OrientedCloud cloud = CloudOf(fine);
  const ControlMesh coarse = Coarse(MarchTetrahedra(BallField, 80), 200);
  const auto lost = FindOutOfReach(cloud, coarse, RunContext());
  ASSERT_TRUE(lost.ok());
  EXPECT_GT(lost->points.size(), 50);
  EXPECT_GT(lost->faces, 0);
  EXPECT_LT(lost->faces, 30);
  for (const int point : lost->points) EXPECT_GT(BallField(cloud.points.col(point)), 0.01) << point;
}

TEST(OutOfReachTest, WhatNoiseMayHaveMadeIsInReach) {
  OrientedCloud cloud = CloudOf(MarchTetrahedra(ProngedBallField, 80));
  cloud.median_noise = 0.1;
  const ControlMesh coarse = Coarse(MarchTetrahedra(BallField, 80), 200);
  EXPECT_TRUE(FindOutOfReach(cloud, coarse, RunContext())->points.empty());
}

TEST(OutOfReachTest, ThreadsDoNotMatterAndStopsAreHeard) {
  const OrientedCloud cloud = CloudOf(MarchTetrahedra(ProngedBallField, 80));
  const ControlMesh coarse = Coarse(MarchTetrahedra(BallField, 80), 200);
  RunContext context;
  context.threads = 1;
  const auto one = FindOutOfReach(cloud, coarse, context);
  context.threads = 4;
  const auto four = FindOutOfReach(cloud, coarse, context);
  EXPECT_EQ(one->points, four->points);
  std::stop_source source;
  source.request_stop();
  context.stop = source.get_token();
  EXPECT_EQ(FindOutOfReach(cloud, coarse, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
