#include "core/scan/local_shape/two_sheets.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

constexpr SheetGap kGap = {0.2, 0.09};
constexpr int kPointCount = 4000;

// Points by turns on z = 0 and z = `wall` over the unit square; the last in its middle.
Eigen::Matrix3Xd TwoSheets(double wall) {
  Random random(3);
  Eigen::Matrix3Xd points(3, kPointCount);
  for (int i = 0; i < kPointCount; ++i) {
    points.col(i) << random.Uniform(), random.Uniform(), i % 2 == 0 ? 0 : wall;
  }
  points.col(kPointCount - 1) << 0.5, 0.5, wall;
  return points;
}

SheetNeighborhood Around(const Eigen::Matrix3Xd& points, const PointIndex& index, int center) {
  std::array<int, kSheetPoints> nearest;
  std::array<double, kSheetPoints> squared;
  index.Nearest(points.col(center), kSheetPoints, nearest.data(), squared.data());
  return {points, nearest, std::sqrt(squared.back())};
}

TEST(SheetNeighborhoodTest, LayersAreTheSheets) {
  const Eigen::Matrix3Xd points = TwoSheets(0.04);
  const PointIndex index(points);
  SheetNeighborhood neighborhood = Around(points, index, kPointCount - 1);
  const auto sheets = neighborhood.FindSheets(kGap);
  ASSERT_EQ(sheets.size(), static_cast<size_t>(neighborhood.count()));
  ASSERT_EQ(neighborhood.point(0), kPointCount - 1);
  for (int i = 0; i < neighborhood.count(); ++i) {
    EXPECT_EQ(sheets[i] == sheets[0], neighborhood.point(i) % 2 == (kPointCount - 1) % 2) << i;
  }
  EXPECT_EQ(neighborhood.Across(0) % 2, kPointCount % 2);
  const Eigen::Vector3d chord = points.col(neighborhood.Across(0)) - points.col(kPointCount - 1);
  EXPECT_LT(chord.head<2>().norm(), 0.04);
}

TEST(SheetNeighborhoodTest, OneSheetHasNoLayers) {
  const Eigen::Matrix3Xd points = SphereCloud(kPointCount, 5).cloud.points;
  const PointIndex index(points);
  for (int i = 0; i < kPointCount; i += 400) {
    EXPECT_TRUE(Around(points, index, i).FindSheets(kGap).empty());
  }
}

TEST(SheetNeighborhoodTest, PointsOnALineHaveNoLayers) {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 100);
  for (int i = 0; i < 100; ++i) points(0, i) = i;
  const PointIndex index(points);
  EXPECT_TRUE(Around(points, index, 50).FindSheets(kGap).empty());
}

}  // namespace
}  // namespace rilievo
