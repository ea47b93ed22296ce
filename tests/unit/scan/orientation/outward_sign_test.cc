#include "core/scan/orientation/outward_sign.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
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
  return cloud;
}

int SignOf(const OrientedCloud& cloud) {
  const std::vector<int> one(static_cast<size_t>(cloud.points.cols()), 0);
  return OutwardSigns(cloud, one, 1).front();
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

TEST(OutwardSignTest, EachPartHasItsOwnSign) {
  OrientedCloud cloud = HeightField([](double, double) { return 0.0; });
  cloud.normals.rightCols(cloud.normals.cols() / 2) *= -1;
  std::vector<int> component(static_cast<size_t>(cloud.points.cols()), 0);
  std::fill(component.begin() + cloud.points.cols() / 2, component.end(), 1);
  EXPECT_EQ(OutwardSigns(cloud, component, 2), (std::vector<int>{1, -1}));
}

}  // namespace
}  // namespace rilievo
