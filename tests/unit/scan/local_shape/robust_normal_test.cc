#include "core/scan/local_shape/robust_normal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "core/scan/local_shape/settings.h"
#include "tests/scans/random.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

// Of the point at the origin among those of `points` nearest to it.
Vector3d NormalAtOrigin(const Eigen::Matrix3Xd& points, double noise, const Vector3d& plane,
                        int neighbor_count = 16) {
  Eigen::Matrix3Xd all(3, points.cols() + 1);
  all << Vector3d::Zero(), points;
  std::vector<int> neighbors(static_cast<size_t>(points.cols()));
  std::iota(neighbors.begin(), neighbors.end(), 1);
  std::sort(neighbors.begin(), neighbors.end(),
            [&](int a, int b) { return all.col(a).norm() < all.col(b).norm(); });
  neighbors.resize(std::min<size_t>(neighbors.size(), static_cast<size_t>(neighbor_count)));
  return RobustNormal(all, 0, neighbors, 1, noise, plane);
}

double LineAngle(const Vector3d& a, const Vector3d& b) {
  return std::acos(std::min(1.0, std::abs(a.dot(b)))) / kDegree;
}

// Points of share pi/4 on the square of half width `half` around the origin.
Eigen::Matrix3Xd Square(double half, Random* random) {
  Eigen::Matrix3Xd points(3, static_cast<int>(4 * half * half / (std::numbers::pi / 4)));
  for (auto point : points.colwise()) {
    point = Vector3d(random->Uniform(-half, half), random->Uniform(-half, half), 0);
  }
  return points;
}

TEST(RobustNormalTest, NeighborsToOneSideOfACurvedPointDoNotTiltIt) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::Matrix3Xd points = Square(4, &random);
    points.row(0) = points.row(0).cwiseAbs();
    for (auto p : points.colwise()) {
      p.z() = 0.05 * p.x() * p.x() - 0.03 * p.x() * p.y() + 0.08 * p.y() * p.y();
    }
    const Vector3d plane = Vector3d(-0.2, 0.02, 1).normalized();  // as a plane through them leans
    EXPECT_LT(LineAngle(NormalAtOrigin(points, 0, plane), Vector3d::UnitZ()), 0.5) << trial;
  }
}

// Half a spacing from the edge of a box, of how many trials it is off by more than a degree.
int WrongBesideAnEdge(int neighbors, int trials) {
  Random random(2);
  int wrong = 0;
  for (int trial = 0; trial < trials; ++trial) {
    Eigen::Matrix3Xd box = Square(4, &random);
    for (auto point : box.colwise()) {
      if (point.x() > 0.5) point = Vector3d(0.5, point.y(), 0.5 - point.x());
    }
    const Vector3d bisector = Vector3d(1, 0, 1).normalized();  // as a plain fit finds
    const Vector3d normal = NormalAtOrigin(box, 0, bisector, neighbors);
    wrong += LineAngle(normal, Vector3d::UnitZ()) > 1 ? 1 : 0;
  }
  return wrong;
}

TEST(RobustNormalTest, BesideAnEdgeIsThatOfItsOwnSide) {
  EXPECT_LE(WrongBesideAnEdge(16, 200), 4);
  EXPECT_LE(WrongBesideAnEdge(50, 200), 4);  // the first 17 count
  EXPECT_LE(WrongBesideAnEdge(kRobustNormal.fewest_robust_neighbors, 200), 30);
}

// The wall of a hole of radius 5 through a plate of thickness 2: half of the neighbours are of the
// plate, and a plain fit is wrong everywhere.
TEST(RobustNormalTest, OnAWallOfAFewPointsIsThatOfTheWall) {
  constexpr double kRadius = 5;
  Random random(3);
  int wrong = 0;
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::Matrix3Xd points(3, 150);
    for (auto point : points.colwise()) {
      // Unrolled: top, wall and bottom one after the other, 5 wide either side of the wall.
      const double angle = random.Uniform(-0.7, 0.7), down = random.Uniform(-5, 7);
      const double r = kRadius + std::max({0.0, -down, down - 2});
      point = Vector3d(kRadius - r * std::cos(angle), r * std::sin(angle),
                       1 - std::clamp(down, 0.0, 2.0));
    }
    const Vector3d normal = NormalAtOrigin(points, 0, Vector3d::UnitZ());
    wrong += LineAngle(normal, Vector3d::UnitX()) > 5 ? 1 : 0;
  }
  EXPECT_LE(wrong, 60);
}

TEST(RobustNormalTest, NoiseOfATenthOfTheSpacingTiltsItByAFewDegrees) {
  Random random(4);
  double sum = 0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    Eigen::Matrix3Xd points = Square(4, &random);
    for (auto p : points.colwise()) p.z() = 0.05 * p.x() * p.x() + 0.1 * random.Normal();
    sum += LineAngle(NormalAtOrigin(points, 0.1, Vector3d::UnitZ()), Vector3d::UnitZ());
  }
  EXPECT_LT(sum / kTrials, 4.5);
}

TEST(RobustNormalTest, IsTheGivenOneWhereFewNeighborsSettleNothing) {
  Random random(5);
  const Vector3d plane = Vector3d(1, 2, 3).normalized();
  const Eigen::Matrix3Xd points = Square(4, &random);
  EXPECT_EQ(NormalAtOrigin(points, 0, plane, kRobustNormal.fewest_robust_neighbors - 1), plane);
  EXPECT_EQ(NormalAtOrigin(Eigen::Matrix3Xd::Zero(3, 16), 0, plane), plane);  // all in one place
}

TEST(RobustNormalTest, OnALineIsAcrossItAndAPointBesideItSettlesThePlane) {
  Eigen::Matrix3Xd line = Eigen::Matrix3Xd::Zero(3, 16);
  for (int i = 0; i < 16; ++i) line(0, i) = i - 7.5;
  const Vector3d plane = Vector3d(0, 0.6, 0.8);
  EXPECT_LT(std::abs(NormalAtOrigin(line, 0, plane).x()), 1e-3);
  line(1, 3) = 0.7;
  line(1, 9) = -0.7;
  EXPECT_LT(LineAngle(NormalAtOrigin(line, 0, plane), Vector3d::UnitZ()), 1);
}

}  // namespace
}  // namespace rilievo
