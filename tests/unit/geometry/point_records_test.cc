#include "core/geometry/point_records.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace rilievo {
namespace {

TEST(LosslessLayoutTest, Float32OnlyWhenNothingIsLost) {
  PointCloud scan;
  scan.points.resize(3, 2);
  scan.points << 0.5, -3, 1.25, 0x1p100, 0, 16777216;
  EXPECT_EQ(LosslessLayout(scan).coordinates, CoordinateType::kFloat32);
  scan.points(0, 0) = std::nan("");
  scan.points(1, 0) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(LosslessLayout(scan).coordinates, CoordinateType::kFloat32);
  for (const double value : {0.1, 16777217.0, 4600000.25001, 1e39, -1e300, 1e-300}) {
    scan.points(2, 1) = value;
    EXPECT_EQ(LosslessLayout(scan).coordinates, CoordinateType::kFloat64) << value;
  }
}

TEST(PackPointsTest, WritesXyzPointByPoint) {
  PointCloud scan;
  scan.points.resize(3, 3);
  scan.points << 1, 4, 7, 2, 5, 8, 3, 6, 9;
  const std::string narrow = PackPoints(scan, 1, 3, {});
  ASSERT_EQ(narrow.size(), 24u);
  float floats[6];
  std::memcpy(floats, narrow.data(), 24);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(floats[i], static_cast<float>(i + 4));
  const std::string wide = PackPoints(scan, 0, 3, {.coordinates = CoordinateType::kFloat64});
  ASSERT_EQ(wide.size(), 72u);
  double doubles[9];
  std::memcpy(doubles, wide.data(), 72);
  for (int i = 0; i < 9; ++i) EXPECT_EQ(doubles[i], i + 1);
  // Little-endian on every machine: 1.0 ends in 0x3f 0xf0.
  EXPECT_EQ(static_cast<unsigned char>(wide[7]), 0x3f);
  EXPECT_EQ(static_cast<unsigned char>(wide[6]), 0xf0);
}

TEST(PackPointsTest, SightsStandBehindTheirPoint) {
  PointCloud scan;
  scan.points = Eigen::Matrix3Xd::Random(3, 5);
  scan.sights.stations = Eigen::Matrix3Xd::Random(3, 300);
  scan.sights.station_of = {0, 299, kNoStation, 7, 258};
  scan.sights.normals = Eigen::Matrix3Xf::Random(3, 5);
  scan.sights.colors = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {0, 128, 255}, {13, 14, 15}};
  const PointLayout layout = LosslessLayout(scan);
  EXPECT_EQ(layout.bytes(), kMostRecordBytes);
  const std::string bytes = PackPoints(scan, 0, 5, layout);
  ASSERT_EQ(bytes.size(), 5 * 41u);
  EXPECT_EQ(bytes.substr(41 + 24, 2), "\x2b\x01") << "299, the low byte first";
  float normal[3];
  std::memcpy(normal, bytes.data() + 4 * 41 + 26, 12);
  EXPECT_EQ(Eigen::Map<Eigen::Vector3f>(normal), scan.sights.normals.col(4));
  EXPECT_EQ(bytes.substr(4 * 41 + 38), "\x0d\x0e\x0f");
  PointCloud back = RoomForPoints(5, layout);
  EXPECT_EQ(UnpackPoints(bytes.substr(0, 82), layout, 0, &back), 2);
  EXPECT_EQ(UnpackPoints(bytes.substr(82), layout, 2, &back), 5);
  EXPECT_EQ(back.points, scan.points);
  EXPECT_EQ(back.sights.station_of, scan.sights.station_of);
  EXPECT_EQ(back.sights.normals, scan.sights.normals);
  EXPECT_EQ(back.sights.colors, scan.sights.colors);
}

TEST(PackTrianglesTest, CornersAreNumbersWithoutASign) {
  PointCloud mesh;
  mesh.triangles.resize(3, 3);
  mesh.triangles << 0, 1, 2, 258, 4, 5, std::numeric_limits<int>::max(), 7, 8;
  std::string bytes = PackTriangles(mesh, 0, 3);
  ASSERT_EQ(bytes.size(), 3 * 12u);
  EXPECT_EQ(bytes.substr(4, 4), std::string("\x02\x01\0\0", 4)) << "258, the low byte first";
  EXPECT_EQ(PackTriangles(mesh, 1, 2), bytes.substr(12, 12));
  EXPECT_EQ(PackTriangles(PointCloud(), 0, 0), "");
  PointCloud back;
  back.triangles.resize(3, 3);
  EXPECT_EQ(UnpackTriangles(bytes.substr(0, 12), 0, &back), 1);
  EXPECT_EQ(UnpackTriangles(bytes.substr(12), 1, &back), 3);
  EXPECT_EQ(back.triangles, mesh.triangles);
  // no matrix has columns 2^31 and more.
  bytes.replace(0, 8, std::string("\0\0\0\x80\xff\xff\xff\xff", 8));
  UnpackTriangles(bytes, 0, &back);
  EXPECT_EQ(back.triangles.col(0), Eigen::Vector3i(-1, -1, std::numeric_limits<int>::max()));
}

}  // namespace
}  // namespace rilievo
