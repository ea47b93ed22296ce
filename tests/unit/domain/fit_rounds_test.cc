#include "core/domain/fit_rounds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "core/domain/fold_guard.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

class Rounds : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(StartRounds(samples_, mesh_.vertices, RunContext(), &search_, &state_).ok());
  }
  bool Take(const std::function<void()>& move, double worst_ratio) {
    bool taken = false;
    EXPECT_TRUE(
        TakeRound(samples_, move, worst_ratio, RunContext(), &search_, &state_, &taken).ok());
    return taken;
  }

  const OrientedCloud cloud_ = SphereCloud(0.3, 5'000);
  const PointIndex index_{cloud_.points};
  const ControlMesh mesh_ = OctahedralSphere(0.3, 2);
  const DomainSamples samples_ = *BuildDomainSamples(mesh_, 2, RunContext());
  FootPointSearch search_{cloud_, index_, samples_, 2.0};
  FitState state_;
};

TEST_F(Rounds, MeasureBeforeAndAfter) {
  ASSERT_EQ(state_.rms.size(), 1u);
  // Loop's limit lies inside the control mesh: growing it brings it nearer.
  EXPECT_TRUE(Take([&] { state_.control_points *= 1.05; }, 1.0));
  ASSERT_EQ(state_.rms.size(), 2u);
  EXPECT_LT(state_.rms[1], state_.rms[0]);
  EXPECT_NEAR(state_.largest_move, 0.015, 1e-12);
  SampledSurface surface;
  ASSERT_TRUE(SampleSurface(samples_, state_.control_points, RunContext(), &surface).ok());
  EXPECT_EQ(surface.positions, state_.surface.positions);
}

TEST_F(Rounds, TakeBackWhatMakesThingsWorse) {
  EXPECT_FALSE(Take([&] { state_.control_points *= 0.98; }, 1.05));
  EXPECT_EQ(state_.control_points, mesh_.vertices);
  EXPECT_EQ(state_.rms.size(), 1u);
  EXPECT_EQ(state_.largest_move, 0);
  SampledSurface surface;
  ASSERT_TRUE(SampleSurface(samples_, mesh_.vertices, RunContext(), &surface).ok());
  EXPECT_EQ(state_.surface.positions, surface.positions);
  EXPECT_TRUE(Take([&] { state_.control_points *= 0.98; }, 0));
}

TEST_F(Rounds, TakeBackWhatIsNotFinite) {
  const auto spoil = [&] {
    state_.control_points(1, 7) = std::numeric_limits<double>::quiet_NaN();
  };
  EXPECT_FALSE(Take(spoil, 0));
  EXPECT_EQ(state_.control_points, mesh_.vertices);
}

TEST_F(Rounds, UndoFolds) {
  // Vertex 20 pulled along the sphere, over its neighbours.
  const int neighbor = samples_.control_rings.neighbors[samples_.control_rings.neighbor_begin[20]];
  const Eigen::Vector3d pull = 3 * (mesh_.vertices.col(neighbor) - mesh_.vertices.col(20));
  Eigen::Matrix3Xd pulled = mesh_.vertices;
  pulled.col(20) += pull;
  SampledSurface surface;
  ASSERT_TRUE(SampleSurface(samples_, pulled, RunContext(), &surface).ok());
  EXPECT_THAT(FindFolds(samples_, surface, RunContext()), testing::Contains(testing::Gt(0.0)));
  EXPECT_TRUE(Take([&] { state_.control_points.col(20) += pull; }, 0));
  EXPECT_THAT(FindFolds(samples_, state_.surface, RunContext()), testing::Each(0));
}

TEST_F(Rounds, UndoWhatLeavesThePoints) {
  for (int round = 0; round < 2; ++round) {
    EXPECT_TRUE(Take(
        [&] {
          state_.control_points.col(20) *= 1.6;
          state_.control_points.col(5) *= 1.001;
        },
        0));
    EXPECT_EQ(state_.control_points.col(20), mesh_.vertices.col(20));
  }
  EXPECT_NEAR(state_.control_points.col(5).norm(), mesh_.vertices.col(5).norm() * 1.002001, 1e-9);
}

TEST_F(Rounds, WhatComesBackToThePointsFoldsNothing) {
  const int begin = samples_.control_rings.neighbor_begin[20];
  const int neighbor = samples_.control_rings.neighbors[begin + 1];
  const Eigen::Vector3d way = mesh_.vertices.col(20) - mesh_.vertices.col(neighbor);
  EXPECT_TRUE(Take(
      [&] {
        state_.control_points.col(20) = 1.6 * (mesh_.vertices.col(20) + way);
        state_.control_points.col(neighbor) += 1.2 * way;
      },
      0));
  EXPECT_THAT(FindFolds(samples_, state_.surface, RunContext()), testing::Each(0));
}

// Over a hole nothing says where the surface runs.
TEST(RoundsOverAHole, MoveAsTheyAreAsked) {
  const OrientedCloud whole = SphereCloud(0.3, 5'000);
  const ControlMesh mesh = OctahedralSphere(0.3, 2);
  std::vector<int> kept;
  for (int i = 0; i < whole.points.cols(); ++i) {
    if ((whole.points.col(i) - mesh.vertices.col(20)).norm() > 0.1) kept.push_back(i);
  }
  OrientedCloud cloud;
  cloud.points = whole.points(Eigen::all, kept);
  cloud.normals = whole.normals(Eigen::all, kept);
  cloud.spacing.assign(kept.size(), whole.spacing.front());
  cloud.noise.assign(kept.size(), 0.0f);
  const PointIndex index(cloud.points);
  const DomainSamples samples = *BuildDomainSamples(mesh, 2, RunContext());
  FootPointSearch search(cloud, index, samples, 2.0);
  FitState state;
  ASSERT_TRUE(StartRounds(samples, mesh.vertices, RunContext(), &search, &state).ok());
  bool taken = false;
  ASSERT_TRUE(TakeRound(
                  samples, [&] { state.control_points.col(20) *= 1.6; }, 0, RunContext(), &search,
                  &state, &taken)
                  .ok());
  EXPECT_EQ(state.control_points.col(20), 1.6 * mesh.vertices.col(20));
}

}  // namespace
}  // namespace rilievo
