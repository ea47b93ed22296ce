#include "core/control/cell_sizes.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/control/oriented_shapes.h"

namespace rilievo {
namespace {

std::vector<float> CellsOf(const OrientedShape& shape) {
  return WantedCells(shape.cloud, shape.graph, shape.index, ImplicitOptions{}, RunContext{})
      .value();
}

// Adds the same points again, moved inwards by `thickness` where z > 0, with the normals turned.
OrientedShape WithInnerWall(OrientedShape shape, double thickness) {
  OrientedCloud& cloud = shape.cloud;
  std::vector<int> upper;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    if (cloud.points(2, i) > 0) upper.push_back(i);
  }
  const int64_t outer = cloud.points.cols(), inner = static_cast<int64_t>(upper.size());
  Eigen::Matrix3Xd points(3, outer + inner), normals(3, outer + inner);
  const Eigen::Matrix3Xd inner_normals = cloud.normals(Eigen::all, upper);
  points << cloud.points, cloud.points(Eigen::all, upper) - thickness * inner_normals;
  normals << cloud.normals, -inner_normals;
  cloud.points = points;
  cloud.normals = normals;
  cloud.spacing.resize(outer + inner, cloud.spacing[0]);
  cloud.noise.resize(outer + inner, cloud.noise[0]);
  shape.index = PointIndex(points);
  shape.graph = BuildNeighborGraph(shape.index, points, NeighborOptions{}, RunContext{}).value();
  return shape;
}

TEST(CellSizesTest, FollowTheSpacingOfAPlainSurface) {
  const OrientedShape shape = OrientShape(*MakeTorus(), 20000, kTorusArea);
  for (const float cell : CellsOf(shape)) {
    EXPECT_FLOAT_EQ(cell, static_cast<float>(1.7 * shape.cloud.median_spacing));
  }
}

TEST(CellSizesTest, NoCellIsSmallerThanTheNoiseAllows) {
  const OrientedShape shape = OrientShape(*MakeTorus(), 50000, kTorusArea, 0.02);
  for (const float cell : CellsOf(shape)) EXPECT_GE(cell, static_cast<float>(2.5 * 0.02));
}

// Whether neighbours lie on the other sheet (half a spacing) or none does (three spacings).
TEST(CellSizesTest, ShrinkBetweenTheSheetsOfAWallAndNowhereElse) {
  for (const double spacings : {0.5, 1.5, 3.0}) {
    OrientedShape plain = OrientShape(*MakeSphere(), 20000, kSphereArea);
    const double spacing = plain.cloud.median_spacing;
    const OrientedShape shape = WithInnerWall(std::move(plain), spacings * spacing);
    const std::vector<float> cells = CellsOf(shape);
    int small = 0, walls = 0;
    for (int i = 0; i < shape.cloud.points.cols(); ++i) {
      const double z = shape.cloud.points(2, i);
      if (z > 6 * spacing) {
        ++walls;
        small += cells[i] < 1.5 * spacing;
      }
      if (z < -6 * spacing) {
        EXPECT_FLOAT_EQ(cells[i], static_cast<float>(1.7 * spacing));
      }
      EXPECT_GE(cells[i], 0.6 * spacing);
    }
    EXPECT_GT(small, 0.95 * walls) << spacings << " spacings";
  }
}

}  // namespace
}  // namespace rilievo
