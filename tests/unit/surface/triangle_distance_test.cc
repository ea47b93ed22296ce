#include "core/surface/triangle_distance.h"

#include <array>
#include <cmath>
#include <vector>

#include "gtest/gtest.h"
#include "tests/unit/surface/test_shapes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

TEST(SquaredDistanceToTriangleTest, EveryRegion) {
  const Vector3d a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({0.5, 0.5, 3}, a, b, c), 9);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({-1, -2, 2}, a, b, c), 9);  // corner a
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({4, -1, 0}, a, b, c), 5);   // corner b
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({0, 5, 0}, a, b, c), 9);    // corner c
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({1, -2, 1}, a, b, c), 5);   // edge ab
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({-3, 1, 0}, a, b, c), 9);   // edge ca
  EXPECT_NEAR(SquaredDistanceToTriangle({2, 2, 1}, a, b, c), 3, 1e-12);  // edge bc
}

TEST(SquaredDistanceToTriangleTest, DegenerateTrianglesAreTheirEdges) {
  const Vector3d a(0, 0, 0), b(1, 0, 0), c(3, 0, 0);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({2, 1, 0}, a, b, c), 1);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({2, 1, 0}, b, c, a), 1);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({2, 1, 0}, c, a, b), 1);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({5, 0, 0}, a, b, c), 4);
  EXPECT_DOUBLE_EQ(SquaredDistanceToTriangle({1, 1, 1}, a, a, a), 3);
}

TEST(ClosestWeightsTest, AreThoseOfTheNearestPlace) {
  const std::vector<std::array<Vector3d, 3>> triangles = {
      {Vector3d(0, 0, 0), Vector3d(2, 0, 0), Vector3d(0, 2, 0)},
      {Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(3, 0, 0)},  // no area
      {Vector3d(1, 2, 3), Vector3d(1, 2, 3), Vector3d(1, 2, 3)},
      {Vector3d(0, 0, 0), Vector3d(1, 1e-9, 0), Vector3d(2, 0, 1e-9)},
  };
  for (const auto& [a, b, c] : triangles) {
    for (int i = 0; i < 200; ++i) {
      const Vector3d point = 3 * CounterPoint(i);
      const Vector3d weights = ClosestWeights(point, a, b, c);
      EXPECT_GE(weights.minCoeff(), 0);
      EXPECT_NEAR(weights.sum(), 1, 1e-12);
      const Vector3d place = weights[0] * a + weights[1] * b + weights[2] * c;
      EXPECT_NEAR((point - place).norm(), std::sqrt(SquaredDistanceToTriangle(point, a, b, c)),
                  1e-7);
    }
  }
}

}  // namespace
}  // namespace rilievo
