#include "core/scan/orientation/outward_sign.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

namespace rilievo {
namespace {

constexpr int kSide = 60;

// A surface over [-1, 1]^2, its normals up.
OrientedCloud HeightField(const std::function<double(double, double)>& height) {
  OrientedCloud cloud;
  cloud.points.resize(3, kSide * kSide);
  cloud.normals.resize(3, kSide * kSide);
  for (int i = 0; i < kSide * kSide; ++i) {
    const double x = 2.0 * (i % kSide) / (kSide - 1) - 1, y = 2.0 * (i / kSide) / (kSide - 1) - 1;
    constexpr double kStep = 1e-4;
    const double dx = (height(x + kStep, y) - height(x - kStep, y)) / (2 * kStep);
    const double dy = (height(x, y + kStep) - height(x, y - kStep)) / (2 * kStep);
    cloud.points.col(i) << x, y, height(x, y);
    cloud.normals.col(i) = Eigen::Vector3d(-dx, -dy, 1).normalized();
  }
  cloud.spacing.assign(kSide * kSide, 2.0F / kSide);
  cloud.noise.assign(kSide * kSide, 0.0F);
  return cloud;
}

int SignOf(const OrientedCloud& cloud) {
  std::vector<int> members(static_cast<size_t>(cloud.points.cols()));
  std::iota(members.begin(), members.end(), 0);
  return OutwardSign(cloud, members);
}

TEST(OutwardSignTest, ACapFacesAwayFromItsCentre) {
  OrientedCloud cap = HeightField([](double x, double y) { return -0.4 * (x * x + y * y); });
  EXPECT_EQ(SignOf(cap), 1);
  cap.normals *= -1;
  EXPECT_EQ(SignOf(cap), -1);
}

TEST(OutwardSignTest, AFlatPatchFacesUp) {
  OrientedCloud patch = HeightField([](double, double) { return 0.0; });
  EXPECT_EQ(SignOf(patch), 1);
  patch.normals *= -1;
  EXPECT_EQ(SignOf(patch), -1);
}

// Terrain has hollows and hills: neither side is the convex one.
TEST(OutwardSignTest, AValleyFacesUp) {
  OrientedCloud valley = HeightField([](double x, double) { return 0.08 * x * x; });
  EXPECT_EQ(SignOf(valley), 1);
  valley.normals *= -1;
  EXPECT_EQ(SignOf(valley), -1);
}

TEST(OutwardSignTest, ABowlFacesAwayFromItsCentre) {
  OrientedCloud bowl = HeightField([](double x, double y) { return 0.4 * (x * x + y * y); });
  EXPECT_EQ(SignOf(bowl), -1);
}

// Most of what is farthest out in a street are walls that look inward.
TEST(OutwardSignTest, AStreetFacesUp) {
  OrientedCloud street = HeightField([](double x, double) { return 0.4 * std::pow(x, 8); });
  EXPECT_EQ(SignOf(street), 1);
  street.normals *= -1;
  EXPECT_EQ(SignOf(street), -1);
}

// A wall folded back on itself, as thin as a tenth of its width: hardly any volume is in it.
TEST(OutwardSignTest, AThinWallFacesOutward) {
  OrientedCloud wall = HeightField([](double x, double y) {
    return 0.1 * std::sqrt(std::max(0.0, (1 - std::pow(x, 8)) * (1 - std::pow(y, 8))));
  });
  const Eigen::Index count = wall.points.cols();
  wall.points.conservativeResize(3, 2 * count);
  wall.normals.conservativeResize(3, 2 * count);
  const Eigen::Vector3d mirror(1, 1, -1);
  wall.points.rightCols(count) = mirror.asDiagonal() * wall.points.leftCols(count);
  wall.normals.rightCols(count) = mirror.asDiagonal() * wall.normals.leftCols(count);
  wall.spacing.resize(2 * count, wall.spacing[0]);
  wall.noise.resize(2 * count, 0.0F);
  EXPECT_EQ(SignOf(wall), 1);
  wall.normals *= -1;
  EXPECT_EQ(SignOf(wall), -1);
}

// Only the members count.
TEST(OutwardSignTest, OthersHaveNoSay) {
  OrientedCloud cloud = HeightField([](double, double) { return 0.0; });
  cloud.normals.rightCols(cloud.normals.cols() / 2) *= -1;
  std::vector<int> first(static_cast<size_t>(cloud.points.cols() / 2));
  std::iota(first.begin(), first.end(), 0);
  EXPECT_EQ(OutwardSign(cloud, first), 1);
  for (int& i : first) i += static_cast<int>(first.size());
  EXPECT_EQ(OutwardSign(cloud, first), -1);
}

}  // namespace
}  // namespace rilievo
