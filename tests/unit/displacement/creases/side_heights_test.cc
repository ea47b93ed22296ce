#include "core/displacement/creases/side_heights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/scans/random.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kPoints = 4000;
constexpr double kSlope = 0.8;

// Points of the roof |x| < 0.5, |y| < 0.5 that falls on both sides of its ridge along y; `sides` of
// it, 1 or 2.
RayCloud Roof(double noise, int sides) {
  Random random(3);
  RayCloud cloud;
  for (int i = 0; i < kPoints; ++i) {
    const double x = random.Uniform(sides == 2 ? -0.5 : 0.0, 0.5), y = random.Uniform(-0.5, 0.5);
    const Vector3d normal = Vector3d(x < 0 ? -kSlope : kSlope, 0, 1).normalized();
    const Vector3d at = Vector3d(x, y, -kSlope * std::abs(x)) + noise * random.Normal() * normal;
    RayPoint point = {};
    for (int k = 0; k < 3; ++k) {
      point.position[k] = static_cast<float>(at[k]);
      point.normal[k] = static_cast<float>(normal[k]);
    }
    point.spacing = 0.02f;
    point.noise = static_cast<float>(noise);
    cloud.points.push_back(point);
  }
  return cloud;
}

PointIndex IndexOf(const RayCloud& cloud) {
  Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(cloud.points.size()));
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      points(k, static_cast<Eigen::Index>(i)) = double{cloud.points[i].position[k]};
    }
  }
  return PointIndex(points);
}

Eigen::Matrix3Xd Sides() {
  Eigen::Matrix3Xd sides(3, 2);
  sides.col(0) = Vector3d(-kSlope, 0, 1).normalized();
  sides.col(1) = Vector3d(kSlope, 0, 1).normalized();
  return sides;
}

TEST(SideHeightsTest, RaysMeetTheRidge) {
  const RayCloud cloud = Roof(0, 2);
  const PointIndex index = IndexOf(cloud);
  for (double y : {-0.3, 0.0, 0.2}) {
    const auto met = MeetAlongRay(cloud, index, {0, y, -0.013}, Vector3d::UnitZ(), Sides());
    ASSERT_TRUE(met.has_value());
    EXPECT_NEAR(met->height, 0.013, 1e-6);
    EXPECT_TRUE(met->crease);
    EXPECT_TRUE(met->fitted);
  }
}

TEST(SideHeightsTest, AveragesNoise) {
  const double noise = 0.006;
  const RayCloud cloud = Roof(noise, 2);
  const PointIndex index = IndexOf(cloud);
  double squares = 0;
  int count = 0;
  for (double y = -0.4; y < 0.4; y += 0.02, ++count) {
    const auto met = MeetAlongRay(cloud, index, {0, y, 0.005}, Vector3d::UnitZ(), Sides());
    ASSERT_TRUE(met.has_value());
    EXPECT_GT(met->deviation, 0);
    EXPECT_LT(met->deviation, noise / 2);
    squares += std::pow(met->height + 0.005, 2);
  }
  // Of some ten points a side, across a slope of 0.8.
  EXPECT_LT(std::sqrt(squares / count), noise / 2);
}

TEST(SideHeightsTest, OneSideAloneAndStraysSayNothing) {
  RayCloud cloud = Roof(0, 1);
  const PointIndex index = IndexOf(cloud);
  EXPECT_FALSE(MeetAlongRay(cloud, index, {0, 0, 0}, Vector3d::UnitZ(), Sides()).has_value());
  cloud = Roof(0, 2);
  for (RayPoint& point : cloud.points) {
    for (float& normal : point.normal) normal = std::numeric_limits<float>::quiet_NaN();
  }
  EXPECT_FALSE(
      MeetAlongRay(cloud, IndexOf(cloud), {0, 0, 0}, Vector3d::UnitZ(), Sides()).has_value());
}

}  // namespace
}  // namespace rilievo
