#include "core/scan/clean_normal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <vector>

#include "tests/scans/random.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

// The point at the origin and the 16 of `points` nearest to it.
Vector3d NormalAtOrigin(const Eigen::Matrix3Xd& points, double noise, const Vector3d& plane) {
  Eigen::Matrix3Xd all(3, points.cols() + 1);
  all << Vector3d::Zero(), points;
  std::vector<int> neighbors(static_cast<size_t>(points.cols()));
  std::iota(neighbors.begin(), neighbors.end(), 1);
  std::sort(neighbors.begin(), neighbors.end(),
            [&](int a, int b) { return all.col(a).norm() < all.col(b).norm(); });
  neighbors.resize(std::min<size_t>(neighbors.size(), 16));
  return CleanNormal(all, 0, neighbors, 1, noise, plane);
}

double LineAngle(const Vector3d& a, const Vector3d& b) {
  return std::acos(std::min(1.0, std::abs(a.dot(b)))) / kDegree;
}

// Points of share pi/4 over the square of half width `half`, lifted.
Eigen::Matrix3Xd Lifted(double half, Random* random,
                        const std::function<double(double, double)>& height) {
  Eigen::Matrix3Xd points(3, static_cast<int>(4 * half * half / (std::numbers::pi / 4)));
  for (auto point : points.colwise()) {
    const double x = random->Uniform(-half, half), y = random->Uniform(-half, half);
    point = Vector3d(x, y, height(x, y));
  }
  return points;
}

TEST(CleanNormalTest, NeighborsToOneSideOfACurvedPointDoNotTiltIt) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    Eigen::Matrix3Xd points = Lifted(
        4, &random, [](double x, double y) { return 0.05 * x * x - 0.03 * x * y + 0.08 * y * y; });
    points.row(0) = points.row(0).cwiseAbs();
    points.row(2) = 0.05 * points.row(0).array().square() -
                    0.03 * points.row(0).array() * points.row(1).array() +
                    0.08 * points.row(1).array().square();
    const Vector3d plane = Vector3d(-0.2, 0.02, 1).normalized();  // as a plane through them leans
    EXPECT_LT(LineAngle(NormalAtOrigin(points, 0, plane), Vector3d::UnitZ()), 0.5) << trial;
  }
}

// Half a spacing from the edge of a box a plain fit bisects the sides.
TEST(CleanNormalTest, BesideAnEdgeIsThatOfItsOwnSide) {
  Random random(2);
  int wrong = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::Matrix3Xd points =
        Lifted(4, &random, [](double x, double) { return x < 0.5 ? 0 : -(x - 0.5) * 50; });
    Eigen::Matrix3Xd box = points;
    for (auto point : box.colwise()) {
      if (point.x() > 0.5) point = Vector3d(0.5, point.y(), 0.5 - point.x());
    }
    const Vector3d bisector = Vector3d(1, 0, 1).normalized();
    wrong += LineAngle(NormalAtOrigin(box, 0, bisector), Vector3d::UnitZ()) > 1 ? 1 : 0;
  }
  EXPECT_LE(wrong, 4);
}

// The wall of a hole of radius 5 through a plate of thickness 2: half of the neighbours are of the
// plate, and a plain fit is wrong everywhere.
TEST(CleanNormalTest, OnAWallOfAFewPointsIsThatOfTheWall) {
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

TEST(CleanNormalTest, NoiseOfATenthOfTheSpacingTiltsItByAFewDegrees) {
  Random random(4);
  double sum = 0;
  constexpr int kTrials = 200;
  for (int trial = 0; trial < kTrials; ++trial) {
    Eigen::Matrix3Xd points = Lifted(4, &random, [](double x, double) { return 0.05 * x * x; });
    for (auto point : points.colwise()) point.z() += 0.1 * random.Normal();
    sum += LineAngle(NormalAtOrigin(points, 0.1, Vector3d::UnitZ()), Vector3d::UnitZ());
  }
  EXPECT_LT(sum / kTrials, 4.5);
}

TEST(CleanNormalTest, IsTheGivenOneWhereFewNeighborsSettleNothing) {
  Random random(5);
  const Vector3d plane = Vector3d(1, 2, 3).normalized();
  const Eigen::Matrix3Xd points = Lifted(4, &random, [](double, double) { return 0.0; });
  EXPECT_EQ(NormalAtOrigin(points.leftCols(5), 0, plane), plane);
  EXPECT_EQ(NormalAtOrigin(Eigen::Matrix3Xd::Zero(3, 16), 0, plane), plane);  // all in one place
}

// A line, and a line with one point beside it.
TEST(CleanNormalTest, IsAUnitVectorOnPoorNeighborhoods) {
  Eigen::Matrix3Xd line = Eigen::Matrix3Xd::Zero(3, 16);
  for (int i = 0; i < 16; ++i) line(0, i) = i - 7.5;
  EXPECT_NEAR(NormalAtOrigin(line, 0, Vector3d::UnitZ()).norm(), 1, 1e-12);
  line(1, 3) = 0.7;
  EXPECT_NEAR(NormalAtOrigin(line, 0, Vector3d::UnitZ()).norm(), 1, 1e-12);
}

}  // namespace
}  // namespace rilievo
