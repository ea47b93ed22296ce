#include "client/library/point_packing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace rilievo {
namespace {

TEST(LosslessFormat, Float32OnlyWhenNothingIsLost) {
  PointCloud scan;
  scan.points.resize(3, 2);
  scan.points << 0.5, -3, 1.25, 0x1p100, 0, 16777216;
  EXPECT_EQ(LosslessFormat(scan), v1::COORDINATE_FORMAT_FLOAT32_LE);
  scan.points(0, 0) = std::nan("");
  scan.points(1, 0) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(LosslessFormat(scan), v1::COORDINATE_FORMAT_FLOAT32_LE);
  for (const double value : {0.1, 16777217.0, 4600000.25001, 1e39, -1e300, 1e-300}) {
    scan.points(2, 1) = value;
    EXPECT_EQ(LosslessFormat(scan), v1::COORDINATE_FORMAT_FLOAT64_LE) << value;
  }
}

TEST(PackPoints, WritesXyzPointByPoint) {
  PointCloud scan;
  scan.points.resize(3, 3);
  scan.points << 1, 4, 7, 2, 5, 8, 3, 6, 9;
  const std::string narrow = PackPoints(scan, 1, 3, v1::COORDINATE_FORMAT_FLOAT32_LE);
  ASSERT_EQ(narrow.size(), 24u);
  float floats[6];
  std::memcpy(floats, narrow.data(), 24);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(floats[i], static_cast<float>(i + 4));
  const std::string wide = PackPoints(scan, 0, 3, v1::COORDINATE_FORMAT_FLOAT64_LE);
  ASSERT_EQ(wide.size(), 72u);
  double doubles[9];
  std::memcpy(doubles, wide.data(), 72);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(doubles[i], i + 1);
  // Little-endian on every machine: 1.0 ends in 0x3f 0xf0.
  EXPECT_EQ(static_cast<unsigned char>(wide[7]), 0x3f);
  EXPECT_EQ(static_cast<unsigned char>(wide[6]), 0xf0);
}

}  // namespace
}  // namespace rilievo
