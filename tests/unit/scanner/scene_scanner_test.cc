#include "tests/scans/scene_scanner.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/scans/scene_builder.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// A floor with a box on it, seen from one side.
Scene FloorAndBox() {
  SceneBuilder builder(0.25);
  builder.AddFace({-3, -3, 0}, 6 * Vector3d::UnitX(), 6 * Vector3d::UnitY());
  builder.AddBox({-0.5, -0.5, 0}, {0.5, 0.5, 1});
  return {"box", builder.Take(), {{{2.5, 0, 1.5}, -1.2, 0.2}}, {}};
}

Vector3d CenterOf(const Scene& scene, int triangle) {
  return scene.truth.vertices(Eigen::all, scene.truth.triangles.col(triangle)).rowwise().mean();
}

TEST(SceneScannerTest, WhatLiesBehindABoxIsNotSeen) {
  const Scene scene = FloorAndBox();
  const SceneScan scan = ScanScene(scene, {.points = 20000}).value();
  ASSERT_EQ(scan.cloud.points.cols(), 20000);
  int faces_towards = 0;
  for (int f = 0; f < scene.truth.triangles.cols(); ++f) {
    const Vector3d center = CenterOf(scene, f);
    if (center.x() == -0.5) {
      EXPECT_EQ(scan.seen[f], 0) << "the far side of the box";
    }
    if (center.z() == 0 && center.x() < -0.6 && center.x() > -1 && std::abs(center.y()) < 0.2) {
      EXPECT_EQ(scan.seen[f], 0) << "the floor in its shadow";
    }
    if (center.x() == 0.5) faces_towards += scan.seen[f];
  }
  EXPECT_EQ(faces_towards, 2 * 4 * 4) << "the whole near side, from outside";
}

TEST(SceneScannerTest, CleanReturnsLieOnTheScene) {
  const SceneScan scan = ScanScene(FloorAndBox(), {.points = 5000}).value();
  for (const auto& point : scan.cloud.points.colwise()) {
    const bool on_floor = std::abs(point.z()) < 1e-9;
    const bool on_box = std::abs(point.z() - 1) < 1e-9 || std::abs(point.x() - 0.5) < 1e-9 ||
                        std::abs(std::abs(point.y()) - 0.5) < 1e-9;
    EXPECT_TRUE(on_floor || on_box) << point.transpose();
  }
}

TEST(SceneScannerTest, NoiseHasTheDeviationAskedFor) {
  Scene scene = FloorAndBox();
  const double sigma = 0.002 * scene.bounds().diagonal().norm();
  const SceneScan clean = ScanScene(scene, {.points = 5000}).value();
  const SceneScan noisy = ScanScene(scene, {.points = 5000, .noise = 0.002}).value();
  // Until a first face is met at another angle both take the same rays.
  const Eigen::Matrix3Xd moved = noisy.cloud.points - clean.cloud.points;
  EXPECT_NEAR(std::sqrt(moved.colwise().squaredNorm().mean()), sigma, 0.1 * sigma);
}

TEST(SceneScannerTest, TheSameSeedGivesTheSameBytes) {
  const Scene scene = MakeRooms();
  const SceneScan a = ScanScene(scene, {.points = 3000, .noise = 0.001}).value();
  const SceneScan b = ScanScene(scene, {.points = 3000, .noise = 0.001}).value();
  EXPECT_EQ(a.cloud.points, b.cloud.points);
  EXPECT_EQ(a.seen, b.seen);
}

// Whoever stands inside sees every face from its outside.
TEST(SceneScannerTest, ScenesAreSeenFromOutsideOfTheirFaces) {
  for (const Scene& scene : {MakeStreet(), MakeBlock(), MakeRooms()}) {
    const SceneScan scan = ScanScene(scene, {.points = 20000}).value();
    int64_t outside = 0, inside = 0;
    for (const int8_t side : scan.seen) {
      outside += side > 0;
      inside += side < 0;
    }
    EXPECT_GT(outside, 1000) << scene.name;
    EXPECT_EQ(inside, 0) << scene.name;
  }
}

TEST(SceneScannerTest, AScannerThatSeesNothingIsRefused) {
  Scene scene = FloorAndBox();
  scene.stations = {{{0, 0, 5}, 0.3, 0.9}};
  EXPECT_EQ(ScanScene(scene, {.points = 100}).status().code(),
            absl::StatusCode::kFailedPrecondition);
  scene.stations.clear();
  EXPECT_EQ(ScanScene(scene, {.points = 100}).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
