// Where the points lie that are left of a scan.
#include "core/paging/cell_thinner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "core/points/morton_order.h"

namespace rilievo {
namespace {

constexpr int kPoints = 20000, kMost = 4000;

// Points of the square [-0.45, 0.45]^2 at `height`, thinned to `most`.
Eigen::Matrix3Xd ThinnedField(const std::function<double(double x, double y)>& height,
                              int64_t most = kMost) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-0.45, 0.45);
  Eigen::Matrix3Xd points(3, kPoints);
  for (auto point : points.colwise()) {
    const double x = place(random), y = place(random);
    point << x, y, height(x, y);
  }
  const MortonOrder curve = ComputeMortonOrder(points, RunContext{}).value();
  const SpatialFrame frame{Eigen::Vector3d::Zero(), 1};
  CellDetail limit = CellThinner::kMostDetail;
  for (;;) {
    CellThinner thinner(frame, 4, 9, limit);
    for (const int i : curve.order) thinner.Add(points.col(i));
    Eigen::Matrix3Xd thinned = thinner.Finish();
    if (limit < CellThinner::kMostDetail) return thinned;
    limit = thinner.LimitFor(most);
  }
}

// The share of all points that is left where `is_there`.
double LeftWhere(const Eigen::Matrix3Xd& thinned, double share_of_area,
                 const std::function<bool(double x, double y)>& is_there) {
  double left = 0;
  for (const auto point : thinned.colwise()) left += is_there(point.x(), point.y()) ? 1 : 0;
  return left / (share_of_area * kPoints);
}

bool IsAtBorder(double x, double y) { return std::max(std::abs(x), std::abs(y)) > 0.44; }
constexpr double kBorderArea = 1 - (0.44 * 0.44) / (0.45 * 0.45);

TEST(CellThinner, KeepsTheBorderOfAPlane) {
  const Eigen::Matrix3Xd thinned =
      ThinnedField([](double x, double y) { return 0.1 * x + 0.2 * y; });
  EXPECT_LE(thinned.cols(), kMost);
  EXPECT_GT(LeftWhere(thinned, kBorderArea, IsAtBorder), 0.6);
  const auto is_inside = [](double x, double y) { return !IsAtBorder(x, y); };
  EXPECT_LT(LeftWhere(thinned, 1 - kBorderArea, is_inside), 0.25);
}

// One point in ten is kept. Cells taken for borders by chance would keep all of their points and
// leave wide gaps elsewhere.
TEST(CellThinner, ThinsAnEvenSurfaceEvenly) {
  const auto height = [](double x, double y) { return 0.3 * (x * x + y * y); };
  const Eigen::Matrix3Xd thinned = ThinnedField(height, kPoints / 10);
  EXPECT_GT(thinned.cols(), kPoints / 12);
  const double even = 0.9 / std::sqrt(static_cast<double>(thinned.cols()));
  double widest = 0;
  for (double x = -0.4; x < 0.4; x += 0.01) {
    for (double y = -0.4; y < 0.4; y += 0.01) {
      const Eigen::Vector3d place(x, y, height(x, y));
      widest = std::max(widest,
                        std::sqrt((thinned.colwise() - place).colwise().squaredNorm().minCoeff()));
    }
  }
  EXPECT_LT(widest, 1.5 * even);
}

// The edge runs askew to the cells: where it lies in their faces, each cell sees one plane.
TEST(CellThinner, KeepsMoreBesideASharpEdge) {
  const auto from_edge = [](double x, double y) { return std::abs(x + 0.3 * y - 0.013); };
  const Eigen::Matrix3Xd thinned =
      ThinnedField([&](double x, double y) { return 0.5 * from_edge(x, y); }, 2000);
  const double beside = LeftWhere(thinned, 0.02 * 0.6 / 0.81, [&](double x, double y) {
    return from_edge(x, y) < 0.01 && std::abs(y) < 0.3;
  });
  const double on_planes = LeftWhere(thinned, 0.4 * 0.6 / 0.81, [&](double x, double y) {
    return from_edge(x, y) > 0.05 && from_edge(x, y) < 0.25 && std::abs(y) < 0.3;
  });
  EXPECT_GT(beside, 2 * on_planes);
}

TEST(CellThinner, KeepsMoreWhereTwoSheetsAreClose) {
  const Eigen::Matrix3Xd thinned = ThinnedField([](double x, double y) {
    const bool second = static_cast<int>(std::floor(1e6 * x + 1e6 * y)) % 2 == 0;
    return x > 0.1 && second ? 0.02 : 0.001;
  });
  const auto left = [&](double low) {
    return LeftWhere(thinned, 0.2 * 0.6 / 0.81, [low](double x, double y) {
      return x > low && x < low + 0.2 && std::abs(y) < 0.3;
    });
  };
  EXPECT_GT(left(0.15), 1.5 * left(-0.35));
}

TEST(CellThinner, NoiseIsThinnedEvenly) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.002);
  const Eigen::Matrix3Xd thinned =
      ThinnedField([&](double, double) { return noise(random); }, 3000);
  const auto left = [&](double low) {
    return LeftWhere(thinned, 0.2 * 0.4 / 0.81, [low](double x, double y) {
      return x > low && x < low + 0.2 && std::abs(y) < 0.2;
    });
  };
  EXPECT_NEAR(left(-0.2), left(0), 0.3 * left(0));
}

TEST(CellThinner, ThePromisedNumberIsKept) {
  for (const int64_t most : {1500, 9000}) {
    const Eigen::Matrix3Xd thinned = ThinnedField(
        [](double x, double y) { return 0.05 * std::sin(9 * x) * std::cos(7 * y); }, most);
    EXPECT_LE(thinned.cols(), most);
    EXPECT_GT(static_cast<double>(thinned.cols()), 0.9 * static_cast<double>(most));
  }
}

}  // namespace
}  // namespace rilievo
