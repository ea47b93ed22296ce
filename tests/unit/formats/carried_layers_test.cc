// Colours of a scan on a surface, against a search of all points.
#include "client/formats/carried_layers.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace rilievo {
namespace {

ScanFile RandomScan(int count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-1, 1);
  ScanFile scan;
  scan.format = "test";
  scan.cloud.points.resize(3, count);
  for (int i = 0; i < count; ++i) {
    scan.cloud.points.col(i) << 4.6e6 + place(random), place(random), place(random);
    scan.layers.intensity.push_back(static_cast<float>(i));
    scan.cloud.sights.colors.push_back({static_cast<uint8_t>(i), static_cast<uint8_t>(i >> 8), 7});
  }
  return scan;
}

TEST(CarriedLayersTest, EachVertexTakesItsNearestPoint) {
  ScanFile scan = RandomScan(700);
  scan.cloud.points(1, 3) = std::numeric_limits<double>::quiet_NaN();
  scan.cloud.points(2, 4) = std::numeric_limits<double>::infinity();
  const Eigen::Matrix3Xd vertices = RandomScan(2500).cloud.points.rightCols(1500);
  const auto layers = LayersAt(vertices, scan, RunContext());
  ASSERT_TRUE(layers.ok()) << layers.status();
  ASSERT_EQ(layers->intensity.size(), 1500u);
  ASSERT_EQ(layers->colors.size(), 1500u);
  for (Eigen::Index v = 0; v < vertices.cols(); ++v) {
    int nearest = -1;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 700; ++i) {
      const double distance = (scan.cloud.points.col(i) - vertices.col(v)).squaredNorm();
      if (distance < least) {
        least = distance;
        nearest = i;
      }
    }
    EXPECT_EQ(layers->intensity[static_cast<size_t>(v)], static_cast<float>(nearest));
    EXPECT_EQ(layers->colors[static_cast<size_t>(v)][1], nearest >> 8);
  }
  RunContext one;
  one.threads = 1;
  EXPECT_EQ(LayersAt(vertices, scan, one)->intensity, layers->intensity);
}

TEST(CarriedLayersTest, AScanWithoutLayersOrPointsIsRefused) {
  ScanFile scan = RandomScan(5);
  const Eigen::Matrix3Xd vertices = scan.cloud.points;
  scan.cloud.sights.colors.clear();
  EXPECT_TRUE(LayersAt(vertices, scan, RunContext())->colors.empty());
  scan.layers.intensity.clear();
  EXPECT_THAT(std::string(LayersAt(vertices, scan, RunContext()).status().message()),
              ::testing::HasSubstr("neither colours nor intensity"));
  ScanFile broken = RandomScan(5);
  broken.cloud.points.row(0).setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(LayersAt(vertices, broken, RunContext()).ok());
}

}  // namespace
}  // namespace rilievo
