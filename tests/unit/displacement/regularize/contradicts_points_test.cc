#include "core/displacement/regularize/contradicts_points.h"

#include <gtest/gtest.h>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;
using Eigen::Vector3d;

constexpr double kHalf = 0.3;

struct JitteredSheet : ::testing::Test {
  explicit JitteredSheet(double noises = 0) {
    Random random(7);
    const Points points =
        HeightFieldPoints(kHalf, 3600, &random, [](double, double) { return 0.0; });
    scan = MakeScan(points.Positions(), points.Normals(), 0);
    spacing = scan.cloud.median_spacing;
    for (int i = 0; i < scan.cloud.points.cols(); ++i) {
      scan.cloud.points(2, i) += noises * spacing * Gauss(&random);
      scan.cloud.noise[i] = static_cast<float>(noises * spacing);
    }
    scan.index = PointIndex(scan.cloud.points);
    cloud = *PrepareRayCloud(scan.cloud, scan.graph, RunContext());
  }
  // The share of places, `aside` beyond the middle of a sheet's rim or at random inside, `up` above
  // the sheet, that are contradicted; both in spacings.
  double Denied(bool at_rim, double aside, double up) const {
    Random random(3);
    constexpr int kPlaces = 500;
    int contradicted = 0;
    for (int i = 0; i < kPlaces; ++i) {
      const double x = at_rim ? kHalf + aside * spacing : Uniform(&random, -0.25, 0.25);
      const Vector3d place(x, Uniform(&random, -0.25, 0.25), up * spacing);
      contradicted += ContradictsPoints(cloud, scan.index, place, Vector3d(0.5, 0, 1).normalized());
    }
    return static_cast<double>(contradicted) / kPlaces;
  }
  Scan scan = {{}, PointIndex(Eigen::Matrix3Xd::Zero(3, 1)), {}};
  RayCloud cloud;
  double spacing = 0;
};

struct NoisySheet : JitteredSheet {
  NoisySheet() : JitteredSheet(0.5) {}
};

TEST_F(JitteredSheet, PlacesOnItAreNotDenied) { EXPECT_LT(Denied(false, 0, 0), 0.01); }

TEST_F(JitteredSheet, PlacesOnASharpEdgeAreNotDeniedEither) {
  for (int i = 0; i < scan.cloud.points.cols(); ++i) {
    auto point = scan.cloud.points.col(i), normal = scan.cloud.normals.col(i);
    if (point.x() < 0) continue;
    point = Vector3d(0, point.y(), -point.x());
    normal = Vector3d::UnitX();
  }
  scan.index = PointIndex(scan.cloud.points);
  cloud = *PrepareRayCloud(scan.cloud, scan.graph, RunContext());
  int contradicted = 0;
  for (int i = 0; i < 100; ++i) {
    contradicted +=
        ContradictsPoints(cloud, scan.index, {0, 0.005 * i - 0.25, 0}, Vector3d(1, 0, 1));
  }
  EXPECT_LT(contradicted, 10);
}

TEST_F(JitteredSheet, PlacesOffItAre) {
  EXPECT_EQ(Denied(false, 0, 0.4), 1);
  EXPECT_EQ(Denied(false, 0, -0.4), 1);
}

// No tangent plane speaks against them.
TEST_F(JitteredSheet, PlacesInItsPlaneButPastItsRimAre) { EXPECT_EQ(Denied(true, 0.6, 0), 1); }

TEST_F(NoisySheet, NoiseTakesPartOfTheWord) {
  EXPECT_LT(Denied(false, 0, 0), 0.01);
  EXPECT_LT(Denied(false, 0, 0.4), 0.3);
  EXPECT_GT(Denied(false, 0, 1.8), 0.99);
  EXPECT_GT(Denied(true, 1.0, 0), 0.9);
}

// The far side of a thin wall says nothing; with none else to ask, no plane denies.
TEST_F(JitteredSheet, PointsThatFaceAwayAreNotAsked) {
  for (RayPoint& point : cloud.points) point.normal[2] = -point.normal[2];
  EXPECT_LT(Denied(false, 0, 0.4), 0.05);
}

}  // namespace
}  // namespace rilievo
