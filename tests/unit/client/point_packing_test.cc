#include "client/library/point_packing.h"

#include <gtest/gtest.h>

#include <cstring>

namespace rilievo {
namespace {

TEST(HeaderOf, SaysWhatTheRecordsHold) {
  PointCloud scan;
  scan.points = Eigen::Matrix3Xd::Constant(3, 20, 0.1);
  v1::ReconstructHeader header = HeaderOf(scan, LosslessLayout(scan));
  EXPECT_EQ(header.point_count(), 20u);
  EXPECT_EQ(header.coordinate_format(), v1::COORDINATE_FORMAT_FLOAT64_LE);
  EXPECT_TRUE(header.stations().empty());
  EXPECT_FALSE(header.normals());
  EXPECT_FALSE(header.colors());

  scan.sights.stations = Eigen::Matrix3Xd::Random(3, 2);
  scan.sights.station_of.assign(20, 1);
  scan.sights.normals.setOnes(3, 20);
  scan.sights.colors.resize(20);
  header = HeaderOf(scan, LosslessLayout(scan));
  ASSERT_EQ(header.stations().size(), 48u);
  EXPECT_EQ(std::memcmp(header.stations().data(), scan.sights.stations.data(), 48), 0);
  EXPECT_TRUE(header.normals());
  EXPECT_TRUE(header.colors());
  EXPECT_EQ(header.triangle_count(), 0u);
}

TEST(HeaderOf, OfAMeshSaysHowManyTriangles) {
  PointCloud mesh;
  mesh.points = Eigen::Matrix3Xd::Random(3, 4);
  mesh.triangles.setZero(3, 7);
  EXPECT_EQ(HeaderOf(mesh, LosslessLayout(mesh)).triangle_count(), 7u);
}

}  // namespace
}  // namespace rilievo
