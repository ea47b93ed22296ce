#include "core/scan/orientation/winding_number.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

#include "core/scan/orientation/outward_sign.h"

namespace rilievo {
namespace {

constexpr int kSpherePoints = 5000;

Eigen::Vector3d SpherePoint(int i) {
  const double z = 1 - 2 * (i + 0.5) / kSpherePoints;
  const double turn = 2 * M_PI * i * 0.6180339887498949;
  return {std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z};
}

OrientedCloud Sphere() {
  OrientedCloud cloud;
  cloud.points.resize(3, kSpherePoints);
  for (int i = 0; i < kSpherePoints; ++i) cloud.points.col(i) = SpherePoint(i);
  cloud.normals = cloud.points;
  cloud.spacing.assign(kSpherePoints, static_cast<float>(4 / std::sqrt(kSpherePoints)));
  cloud.noise.assign(kSpherePoints, 0.0f);
  return cloud;
}

std::vector<int> All() {
  std::vector<int> members(kSpherePoints);
  std::iota(members.begin(), members.end(), 0);
  return members;
}

TEST(WindingNumberTest, OneInsideASphereAndNoneOutside) {
  const OrientedCloud cloud = Sphere();
  const WindingField field(cloud, All());
  EXPECT_NEAR(field.At({0.1, 0.2, -0.3}), 1, 0.01);
  EXPECT_NEAR(field.At({0, 0, 0.8}), 1, 0.01);
  EXPECT_NEAR(field.At({1.3, 0, 0}), 0, 0.01);
}

TEST(WindingNumberTest, OneHalfOnASphere) {
  const OrientedCloud cloud = Sphere();
  const WindingField field(cloud, All());
  for (int i = 0; i < kSpherePoints; i += 97) EXPECT_NEAR(field.At(cloud.points.col(i)), 0.5, 0.05);
}

TEST(WindingNumberTest, DescentIsTheGradientAwayFromPoints) {
  const OrientedCloud cloud = Sphere();
  std::vector<int> cap;
  for (int i = 0; i < kSpherePoints; ++i) {
    if (cloud.points(2, i) > 0.3) cap.push_back(i);
  }
  const WindingField field(cloud, cap);
  constexpr double kStep = 0.03;
  for (const Eigen::Vector3d& at : {Eigen::Vector3d(0.2, 0.1, 0.1), Eigen::Vector3d(1.2, 0, 0)}) {
    const Eigen::Vector3d descent = field.DescentAt(at);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(axis);
      const double slope = (field.At(at + step) - field.At(at - step)) / (2 * kStep);
      EXPECT_NEAR(descent[axis], -slope, 0.03);
    }
  }
}

TEST(WindingNumberTest, FallsAlongTheNormalsThatAreMissing) {
  const OrientedCloud cloud = Sphere();
  std::vector<int> rest;
  for (int i = 0; i < kSpherePoints; ++i) {
    if (cloud.points(2, i) < 0.95) rest.push_back(i);
  }
  // At the centre of a hole of radius r in a plane it falls by 1 / 2r.
  const double radius = std::sqrt(1 - 0.95 * 0.95);
  const double fall = WindingField(cloud, rest).DescentAt({0, 0, 0.975}).z();
  EXPECT_NEAR(fall, 0.5 / radius, 0.2 / radius);
}

TEST(WindingNumberTest, FarPointsTogetherAreAsEachAlone) {
  const OrientedCloud cloud = Sphere();
  const WindingField field(cloud, All());
  const Eigen::Vector3d at(0.3, -0.5, 0.55);
  double sum = 0;
  for (int i = 0; i < kSpherePoints; ++i) sum += WindingField(cloud, {i}).At(at);
  EXPECT_NEAR(field.At(at), sum, 0.02);
}

TEST(WindingNumberTest, NoneOfNoPoints) {
  const OrientedCloud cloud = Sphere();
  EXPECT_EQ(WindingField(cloud, {}).At(Eigen::Vector3d::Zero()), 0);
}

TEST(OutwardSignTest, FindsTheOutsideOfASphereEitherWay) {
  OrientedCloud cloud = Sphere();
  const std::vector<int> members = All();
  EXPECT_EQ(OutwardSign(cloud, members), 1);
  cloud.normals = -cloud.points;
  EXPECT_EQ(OutwardSign(cloud, members), -1);
}

}  // namespace
}  // namespace rilievo
