#include "client/formats/scan_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "client/formats/scan_reader.h"

namespace rilievo {
namespace {

constexpr WantedLayers kAll = {
    .intensity = true, .colors = true, .stations = true, .normals = true};

ScanFile WrittenAndRead(const PointCloud& scan, const PointLayers& layers) {
  std::stringstream bytes;
  EXPECT_TRUE(WritePlyScan(scan, layers, bytes).ok());
  return ReadPlyScan(bytes, kAll).value();
}

TEST(ScanWriterTest, AllThatIsKnownOfThePointsComesBack) {
  PointCloud scan{Eigen::Matrix3Xd::Random(3, 5)};
  scan.points(0, 0) = 5e6 + 1e-9;
  scan.sights.stations = Eigen::Matrix3Xd::Random(3, 2);
  scan.sights.station_of = {1, 0, kNoStation, 1, 1};
  scan.sights.normals = Eigen::Matrix3Xf::Random(3, 5);
  scan.sights.colors = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {0, 0, 0}, {255, 255, 255}};
  const PointLayers layers = {{1, 2, 3, 4, 5.5F}, {}};
  const ScanFile read = WrittenAndRead(scan, layers);
  EXPECT_EQ(read.cloud.points, scan.points);
  EXPECT_EQ(read.cloud.sights.normals, scan.sights.normals);
  EXPECT_EQ(read.layers.intensity, layers.intensity);
  EXPECT_EQ(read.cloud.sights.colors, scan.sights.colors);
  for (size_t i = 0; i < 5; ++i) {
    const uint16_t before = scan.sights.station_of[i], after = read.cloud.sights.station_of[i];
    ASSERT_EQ(before == kNoStation, after == kNoStation);
    if (before == kNoStation) continue;
    EXPECT_EQ(scan.sights.stations.col(before), read.cloud.sights.stations.col(after));
  }
}

TEST(ScanWriterTest, PointsAlone) {
  const PointCloud scan{Eigen::Matrix3Xd::Random(3, 4)};
  const ScanFile read = WrittenAndRead(scan, {});
  EXPECT_EQ(read.cloud.points, scan.points);
  EXPECT_TRUE(read.cloud.sights.station_of.empty());
  EXPECT_EQ(read.cloud.sights.normals.cols(), 0);
  EXPECT_TRUE(read.cloud.sights.colors.empty());
}

TEST(ScanWriterTest, SightsAndLayersOfOtherPointsAreRefused) {
  std::stringstream bytes;
  PointCloud scan{Eigen::Matrix3Xd::Random(3, 4)};
  EXPECT_FALSE(WritePlyScan(scan, {{1, 2}, {}}, bytes).ok());
  scan.sights.colors.resize(3);
  EXPECT_FALSE(WritePlyScan(scan, {}, bytes).ok());
  scan.sights.colors.clear();
  scan.sights.normals = Eigen::Matrix3Xf::Random(3, 3);
  EXPECT_FALSE(WritePlyScan(scan, {}, bytes).ok());
}

}  // namespace
}  // namespace rilievo
