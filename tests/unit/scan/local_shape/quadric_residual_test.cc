#include "core/scan/local_shape/quadric_residual.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

namespace rilievo {
namespace {

// 40 points of the relief over a disc of radius 0.1; the first is its middle.
double ResidualOf(const std::function<double(double, double)>& height, int count = 40) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> along(-0.1, 0.1);
  Eigen::Matrix3Xd points(3, count);
  points.col(0) << 0, 0, height(0, 0);
  for (int i = 1; i < count; ++i) {
    const double x = along(random), y = along(random);
    points.col(i) << x, y, height(x, y);
  }
  std::vector<int> neighbors(count - 1);
  std::iota(neighbors.begin(), neighbors.end(), 1);
  return QuadricResidual(points, 0, neighbors, 0.15, Eigen::Vector3d::UnitZ());
}

TEST(QuadricResidualTest, CurvatureIsNoNoise) {
  EXPECT_LT(ResidualOf([](double x, double y) { return 0.1 * x + x * x - 2 * x * y; }), 1e-6);
}

TEST(QuadricResidualTest, IsTheDeviationOfTheNoise) {
  double sum = 0;
  constexpr int kTrials = 50;
  std::mt19937 random(12);
  std::normal_distribution<double> noise(0, 0.002);
  for (int trial = 0; trial < kTrials; ++trial) {
    sum += ResidualOf([&](double x, double) { return x * x + noise(random); });
  }
  EXPECT_NEAR(sum / kTrials, 0.002, 0.0002);
}

// A quadric through both leaves 0.01 everywhere.
TEST(QuadricResidualTest, TwoSheetsAreNoNoise) {
  bool upper = false;
  const auto sheets = [&](double, double) {
    upper = !upper;
    return upper ? 0.01 : -0.01;
  };
  EXPECT_LT(ResidualOf(sheets), 0.005);
}

TEST(QuadricResidualTest, TooFewPointsSayNothing) {
  EXPECT_EQ(ResidualOf([](double x, double) { return std::abs(x); }, 7), 0);
}

}  // namespace
}  // namespace rilievo
