#include "core/control/planar/occupied_area.h"

#include <gtest/gtest.h>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;

OccupiedArea AreaOf(const OrientedCloud& cloud, BoundaryRule boundary, double smallest_hole) {
  return FindOccupiedArea(cloud.points.topRows<2>(), cloud.spacing, cloud.median_spacing,
                          smallest_hole, boundary, RunContext{})
      .value();
}

TEST(FindOccupiedArea, HasTheAreaOfTheSquareWithoutItsHole) {
  const OrientedCloud cloud = TerrainCloud(20000, 0.12);
  const OccupiedArea area = AreaOf(cloud, BoundaryRule::kKeep, 0.001);
  const double truth = 0.7 * 0.7 - std::numbers::pi * 0.12 * 0.12;
  EXPECT_NEAR(area.area(), truth, 0.03 * truth);
  EXPECT_LT(area.Depth(Vector2d(0.1, 0.05)), -0.1);
  EXPECT_NEAR(area.Depth(Vector2d(-0.2, -0.2)), 0.15, 0.01);
  EXPECT_NEAR(area.Depth(Vector2d(0.35, 0)), 0, 0.01);
}

TEST(FindOccupiedArea, CloseFillsTheHole) {
  const OrientedCloud cloud = TerrainCloud(20000, 0.12);
  const OccupiedArea area = AreaOf(cloud, BoundaryRule::kClose, 0);
  EXPECT_NEAR(area.area(), 0.49, 0.015);
  EXPECT_GT(area.Depth(Vector2d(0.1, 0.05)), 0.2);
}

TEST(FindOccupiedArea, SmallHolesAreFilledAndIslandsStay) {
  OrientedCloud small = TerrainCloud(20000, 0.12);
  small.points *= 0.3;
  small.points.row(0).array() += 0.6;
  const OrientedCloud cloud = Joined(TerrainCloud(20000, 0.12), small);
  const double hole = std::numbers::pi * 0.12 * 0.12;
  const OccupiedArea area = AreaOf(cloud, BoundaryRule::kKeep, hole / 3);
  EXPECT_LT(area.Depth(Vector2d(0.1, 0.05)), 0);
  EXPECT_GT(area.Depth(Vector2d(0.6 + 0.03, 0.015)), 0);
  EXPECT_LT(area.Depth(Vector2d(0.42, 0)), 0);
}

TEST(OccupiedArea, DepthIsTheDistanceToTheBorder) {
  OccupiedArea area;
  area.cell = 0.1;
  area.columns = area.rows = 20;
  area.inside.assign(400, 0);
  for (int r = 5; r < 15; ++r) {
    for (int c = 4; c < 14; ++c) area.inside[r * 20 + c] = 1;
  }
  FillHoles(0, BoundaryRule::kKeep, &area);
  // The inside is the rectangle [0.4, 1.4] x [0.5, 1.5].
  EXPECT_NEAR(area.Depth(Vector2d(0.85, 0.95)), 0.45, 1e-6);
  EXPECT_NEAR(area.Depth(Vector2d(0.45, 0.95)), 0.05, 1e-6);
  EXPECT_NEAR(area.Depth(Vector2d(1.65, 0.95)), -0.25, 1e-6);
  EXPECT_NEAR(area.Depth(Vector2d(1.65, 1.75)), 0.05 - 0.3 * std::numbers::sqrt2, 1e-6);
}

}  // namespace
}  // namespace rilievo
