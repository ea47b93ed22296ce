#include "core/surface/surface_samples.h"

#include <numeric>
#include <vector>

#include "gtest/gtest.h"
#include "tests/unit/surface/test_shapes.h"

namespace rilievo {
namespace {

std::vector<int> InOrder(const Shape& shape) {
  std::vector<int> order(shape.triangles.cols());
  std::iota(order.begin(), order.end(), 0);
  return order;
}

TEST(SampleByAreaTest, SharesFollowTheArea) {
  // Two triangles, the second with three times the area of the first.
  Shape shape;
  shape.vertices.resize(3, 6);
  shape.vertices << 0, 1, 0, 5, 8, 5,  //
      0, 0, 1, 0, 0, 1,                //
      0, 0, 0, 0, 0, 0;
  shape.triangles.resize(3, 2);
  shape.triangles << 0, 3, 1, 4, 2, 5;
  const int count = 4000;
  const Eigen::Matrix3Xd points =
      SampleByArea(shape.vertices, shape.triangles, InOrder(shape), count, 1);
  EXPECT_EQ((points.row(0).array() < 3).count(), count / 4);  // slices: no chance in it
  // Uniform within: the mean is the centroid, the second moment that of a triangle.
  const auto second = points.rightCols(3 * count / 4);
  EXPECT_NEAR(second.row(0).mean(), 6, 0.04);
  EXPECT_NEAR(second.row(1).mean(), 1.0 / 3, 0.015);
  EXPECT_NEAR((second.row(1).array() - 1.0 / 3).square().mean(), 1.0 / 18, 0.004);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const double x = points(0, i) < 3 ? points(0, i) : (points(0, i) - 5) / 3;
    EXPECT_GE(x, 0);
    EXPECT_GE(points(1, i), 0);
    EXPECT_LE(x + points(1, i), 1 + 1e-12);
  }
}

// Integrals over a sphere: area slices make the error smaller than independent points would.
TEST(SampleByAreaTest, IntegratesOverASphere) {
  const Shape sphere = SphereShape(1, 60, {0, 0, 0});
  const Eigen::Matrix3Xd points =
      SampleByArea(sphere.vertices, sphere.triangles, InOrder(sphere), 20000, 5);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(points.row(axis).mean(), 0, 0.005);
    EXPECT_NEAR(points.row(axis).array().square().mean(), 1.0 / 3, 0.005);
  }
}

TEST(SampleByAreaTest, DependsOnTheSeedAlone) {
  const Shape sphere = SphereShape(1, 10, {0, 0, 0});
  const auto sample = [&](uint64_t seed) {
    return SampleByArea(sphere.vertices, sphere.triangles, InOrder(sphere), 1000, seed);
  };
  EXPECT_EQ(sample(1), sample(1));
  EXPECT_NE(sample(1), sample(2));
}

TEST(SampleByAreaTest, TrianglesWithoutAreaGetPointsOnlyWhenNoneHasAny) {
  Shape shape = SquareShape(0, 1);
  shape.vertices.conservativeResize(3, 5);
  shape.vertices.col(4) << 50, 0, 0;
  shape.triangles.conservativeResize(3, 3);
  shape.triangles.col(2) << 4, 4, 4;
  Eigen::Matrix3Xd points = SampleByArea(shape.vertices, shape.triangles, InOrder(shape), 2000, 1);
  EXPECT_LE(points.row(0).maxCoeff(), 1);
  const Eigen::Matrix3Xi degenerate = shape.triangles.rightCols(1);
  points = SampleByArea(shape.vertices, degenerate, std::vector<int>{0}, 2000, 1);
  EXPECT_LT((points.row(0).array() - 50).abs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace rilievo
