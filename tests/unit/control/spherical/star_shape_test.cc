#include "core/control/spherical/star_shape.h"

#include <gtest/gtest.h>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

TEST(CheckStarShape, AStarIsOne) {
  const OrientedCloud cloud = StarCloud(9218);
  const StarCheck check = CheckStarShape(cloud, FindStarCenter(cloud), RunContext{}).value();
  EXPECT_EQ(check.coverage, 1);
  EXPECT_EQ(check.single_sheet, 1);
  EXPECT_EQ(check.outward, 1);
}

TEST(CheckStarShape, ASphereIsRadialAtOneRadius) {
  const OrientedCloud cloud = SphereCloud(5000, 0.28, Vector3d(0.01, 0.02, -0.03));
  const Vector3d center = FindStarCenter(cloud);
  EXPECT_LT((center - Vector3d(0.01, 0.02, -0.03)).norm(), 0.005);
  const StarCheck check = CheckStarShape(cloud, center, RunContext{}).value();
  EXPECT_EQ(check.radial, 1);
  EXPECT_LT(check.radius_ratio, 1.05);
}

TEST(CheckStarShape, ATorusAndTwoSpheresAreNone) {
  const OrientedCloud torus = TorusCloud(160, 60);
  const StarCheck ring = CheckStarShape(torus, FindStarCenter(torus), RunContext{}).value();
  EXPECT_LT(std::min(ring.coverage, ring.single_sheet), 0.9);
  const OrientedCloud two = Joined(SphereCloud(4000, 0.12, Vector3d(0.3, 0, 0)),
                                   SphereCloud(4000, 0.12, Vector3d(-0.3, 0, 0)));
  const StarCheck pair = CheckStarShape(two, FindStarCenter(two), RunContext{}).value();
  EXPECT_LT(std::min(pair.coverage, pair.single_sheet), 0.9);
}

TEST(FindStarCenter, LeavesTheCentroidWhereThatSeesTooLittle) {
  // A cone-like drop: nearly all its area is in a long thin neck outside of the round part.
  const Eigen::Matrix3Xd directions = SphereDirections(8000);
  Eigen::Matrix3Xd points(3, directions.cols()), normals(3, directions.cols());
  const auto radius = [](double z) { return 0.1 + 0.4 * std::pow(std::max(0.0, z), 8); };
  for (int i = 0; i < directions.cols(); ++i) {
    const Vector3d d = directions.col(i);
    const double r = radius(d.z());
    const Vector3d slope(0, 0, d.z() > 0 ? 3.2 * std::pow(d.z(), 7) : 0);
    points.col(i) = r * d;
    normals.col(i) = (d - (slope - slope.dot(d) * d) / r).normalized();
  }
  const OrientedCloud cloud = MakeCloud(points, normals);
  const Vector3d center = FindStarCenter(cloud);
  const StarCheck found = CheckStarShape(cloud, center, RunContext{}).value();
  EXPECT_GT(found.outward, 0.99);
  EXPECT_EQ(found.single_sheet, 1);
}

}  // namespace
}  // namespace rilievo
