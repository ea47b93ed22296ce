#include "core/control/implicit/sizing_field.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/control/oriented_shapes.h"

namespace rilievo {
namespace {

std::vector<float> CellsOf(const OrientedShape& shape) {
  return SizingField(shape.cloud, shape.graph, shape.index, ImplicitOptions{}, RunContext{})
      .value();
}

int64_t CountOf(const std::vector<float>& cells, double cell) {
  return std::count_if(cells.begin(), cells.end(),
                       [&](float c) { return std::abs(c - cell) < 1e-5 * cell; });
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
  EXPECT_GT(CountOf(CellsOf(shape), 2.6 * shape.cloud.median_spacing), 0.96 * 20000);
}

TEST(CellSizesTest, AreFinerAlongAnEdgeThanOnTheFacesBesideIt) {
  OrientedShape shape = OrientShape(*MakeSphere(), 20000, kSphereArea);
  OrientedCloud& cloud = shape.cloud;
  // A ridge along the equator: its two sides keep turned normals.
  const double turn = 0.5;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    cloud.normals(2, i) += cloud.points(2, i) > 0 ? turn : -turn;
    cloud.normals.col(i).normalize();
  }
  const std::vector<float> cells = CellsOf(shape);
  int along = 0, fine = 0, beside = 0, coarse = 0;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const double height = std::abs(cloud.points(2, i)) / cloud.median_spacing;
    const bool is_fine = cells[i] < 1.4 * cloud.median_spacing;
    if (height < 0.5) ++along, fine += is_fine;
    if (height > 6) ++beside, coarse += !is_fine;
  }
  EXPECT_GT(fine, 0.96 * along);
  EXPECT_GT(coarse, 0.96 * beside);
}

TEST(CellSizesTest, NoCellIsSmallerThanTheNoiseAllows) {
  const OrientedShape shape = OrientShape(*MakeTorus(), 50000, kTorusArea, 0.02);
  const double least = ImplicitOptions().cell_noises * 0.02;
  for (const float cell : CellsOf(shape)) EXPECT_GE(cell, static_cast<float>(least));
}

// Whether neighbours lie on the other sheet (half a spacing) or hardly one does (two and a half).
TEST(CellSizesTest, ShrinkBetweenTheSheetsOfAWallAndNowhereElse) {
  for (const double spacings : {0.5, 1.5, 2.5}) {
    OrientedShape bare_shape = OrientShape(*MakeSphere(), 20000, kSphereArea);
    const double spacing = bare_shape.cloud.median_spacing;
    const OrientedShape shape = WithInnerWall(std::move(bare_shape), spacings * spacing);
    const std::vector<float> cells = CellsOf(shape);
    int small = 0, walls = 0, plain = 0, bare = 0;
    for (int i = 0; i < shape.cloud.points.cols(); ++i) {
      const double z = shape.cloud.points(2, i);
      if (z > 6 * spacing) {
        ++walls;
        small += cells[i] < 1.25 * spacing;
      }
      if (z < -6 * spacing) {
        ++bare;
        plain += cells[i] > 1.29 * spacing;
      }
      EXPECT_GE(cells[i], 0.6 * spacing);
    }
    EXPECT_GT(small, 0.95 * walls) << spacings << " spacings";
    EXPECT_GT(plain, 0.96 * bare) << spacings << " spacings";
  }
}

TEST(CellSizesTest, ShrinkOnTheBorderOfAnOpenScan) {
  OrientedShape shape = OrientShape(*MakeSphere(), 40000, kSphereArea);
  OrientedCloud& cloud = shape.cloud;
  std::vector<int> upper;
  for (int i = 0; i < cloud.points.cols(); ++i) {
    if (cloud.points(2, i) > 0) upper.push_back(i);
  }
  cloud.points = cloud.points(Eigen::all, upper).eval();
  cloud.normals = cloud.normals(Eigen::all, upper).eval();
  cloud.spacing.resize(upper.size());
  shape.index = PointIndex(cloud.points);
  shape.graph =
      BuildNeighborGraph(shape.index, cloud.points, NeighborOptions{}, RunContext{}).value();
  const std::vector<float> cells = CellsOf(shape);
  const double spacing = cloud.median_spacing;
  int border = 0, small = 0, small_within = 0;
  for (size_t i = 0; i < cells.size(); ++i) {
    const double z = cloud.points(2, static_cast<int64_t>(i));
    const bool is_small = cells[i] < 0.7 * spacing;
    border += z < 0.3 * spacing;
    small += is_small && z < 0.3 * spacing;
    small_within += is_small && z > 4 * spacing;
  }
  EXPECT_GT(small, 0.8 * border);
  EXPECT_LT(small_within, 0.04 * static_cast<double>(cells.size()));
}

}  // namespace
}  // namespace rilievo
