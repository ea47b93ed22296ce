#include "core/domain/scale_surface.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "core/loop/refinement.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr int kTorusLevel = 1;

// A ring around z with waves on it, in a frame of its own.
DisplacedSurface WavyTorus() {
  DisplacedSurface surface;
  surface.frame = {{10, -20, 5}, 50};
  surface.control_mesh = TorusMesh(0.3, 0.1, 64, 26);
  surface.max_level = kTorusLevel;
  const auto refinement = RefineTopology(surface.control_mesh, kTorusLevel, RunContext());
  const int count = refinement->levels.back().vertex_count;
  for (int v = 0; v < count; ++v) {
    surface.heights.push_back(0.001f * static_cast<float>(std::sin(0.7 * v)));
  }
  surface.sources.assign(static_cast<size_t>(count), HeightSource::kMeasured);
  return surface;
}

Eigen::Matrix3Xd VerticesOf(const DisplacedSurface& surface) {
  return Tessellate(surface, kTorusLevel, RunContext())->vertices;
}

DisplacedSurface With(const ControlMesh& cage, DisplacedSurface surface) {
  surface.control_mesh.vertices =
      (cage.vertices.colwise() - surface.frame.center) / surface.frame.diagonal;
  return surface;
}

Eigen::Vector3d SizeOf(const Eigen::Matrix3Xd& points) {
  return points.rowwise().maxCoeff() - points.rowwise().minCoeff();
}

// A piece of the ring, between its farthest points along x and y, around a line along z.
const KeptFeature kLug{{20.6, -9.4, -10}, {20.6, -9.4, 20}, 2};

TEST(ScaleSurfaceTest, TheBoxIsMetAndTheFeatureKeepsItsShape) {
  const DisplacedSurface torus = WavyTorus();
  const Eigen::Matrix3Xd before = VerticesOf(torus);
  const Eigen::Vector3d size = SizeOf(before).cwiseProduct(Eigen::Vector3d(1.3, 0.8, 1.1));
  const auto made = ScaleSurface(torus, size, {kLug}, RunContext());
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_GT(made->held, 50);
  EXPECT_LT((made->size_before - SizeOf(before)).norm(), 1e-12);
  const Eigen::Matrix3Xd after = VerticesOf(With(made->cage, torus));
  EXPECT_LT((SizeOf(after) - size).cwiseAbs().maxCoeff(), 1e-10 * 50 * 1.01);
  // What lies in the feature has moved as a whole.
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = -low;
  int inside = 0;
  const Eigen::Vector3d middle = (before.rowwise().maxCoeff() + before.rowwise().minCoeff()) / 2;
  double farthest = 0;
  for (Eigen::Index v = 0; v < before.cols(); ++v) {
    const Eigen::Vector3d moved = after.col(v) - before.col(v);
    const Eigen::Vector2d away = (before.col(v) - kLug.from).head<2>();
    if (away.norm() <= kLug.radius) {
      ++inside;
      low = low.cwiseMin(moved);
      high = high.cwiseMax(moved);
    } else if (away.norm() > 14) {
      const Eigen::Vector3d scaled =
          middle + size.cwiseQuotient(SizeOf(before)).cwiseProduct(before.col(v) - middle);
      farthest = std::max(farthest, (after.col(v) - scaled).norm());
    }
  }
  EXPECT_GT(inside, 20);
  EXPECT_LT((high - low).maxCoeff(), 1e-9);
  EXPECT_LT(farthest, 0.02 * 50);
}

TEST(ScaleSurfaceTest, WithoutFeaturesItIsTheScaledControlMesh) {
  DisplacedSurface torus = WavyTorus();
  torus.heights.assign(torus.heights.size(), 0);
  const Eigen::Matrix3Xd before = VerticesOf(torus);
  const Eigen::Vector3d factors(2, 0.5, 1.25), size = SizeOf(before).cwiseProduct(factors);
  const auto made = ScaleSurface(torus, size, {}, RunContext());
  ASSERT_TRUE(made.ok()) << made.status();
  const Eigen::Vector3d middle = (before.rowwise().maxCoeff() + before.rowwise().minCoeff()) / 2;
  const Eigen::Matrix3Xd expected =
      (factors.asDiagonal() * (before.colwise() - middle)).colwise() + middle;
  EXPECT_LT((VerticesOf(With(made->cage, torus)) - expected).cwiseAbs().maxCoeff(), 1e-9);
  // The size that it has changes nothing.
  const auto same = ScaleSurface(WavyTorus(), made->size_before, {}, RunContext());
  ASSERT_TRUE(same.ok());
}

TEST(ScaleSurfaceTest, WhatCannotBeScaledIsRefused) {
  const DisplacedSurface torus = WavyTorus();
  const Eigen::Vector3d size(40, 40, 10);
  const auto refused = [&](const Eigen::Vector3d& to, const std::vector<KeptFeature>& features) {
    return ScaleSurface(torus, to, features, RunContext()).status();
  };
  EXPECT_THAT(std::string(refused({1, 0, 1}, {}).message()), HasSubstr("above zero"));
  EXPECT_THAT(std::string(refused(size, {{{0, 0, 0}, {0, 0, 0}, 1}}).message()),
              HasSubstr("feature 1: two different places"));
  EXPECT_THAT(std::string(refused(size, {kLug, {{0, 0, 90}, {0, 0, 99}, 1}}).message()),
              HasSubstr("feature 2 holds no part"));
  EXPECT_THAT(std::string(refused(size, {kLug, kLug}).message()), HasSubstr("feature 2 shares"));
  // A feature from side to side leaves nothing to scale.
  const absl::Status whole = refused(size, {{{10, -20, -90}, {10, -20, 90}, 60}});
  EXPECT_EQ(whole.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(whole.message()), HasSubstr("kept features reach its sides"));
}

TEST(ScaleSurfaceTest, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(ScaleSurface(WavyTorus(), {40, 40, 10}, {kLug}, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
