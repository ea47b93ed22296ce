#include "core/geometry/merge_clouds.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

namespace rilievo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

PointCloud Cloud(int points, int stations) {
  PointCloud cloud{Eigen::Matrix3Xd::Constant(3, points, points)};
  cloud.sights.stations = Eigen::Matrix3Xd::Constant(3, stations, stations);
  if (stations > 0) cloud.sights.station_of.assign(static_cast<size_t>(points), 0);
  return cloud;
}

TEST(MergeCloudsTest, StationsOfEachCloudGetNumbersOfTheirOwn) {
  std::vector<PointCloud> clouds = {Cloud(2, 2), Cloud(1, 0), Cloud(3, 1)};
  clouds[0].sights.station_of = {1, kNoStation};
  const PointCloud merged = MergeClouds(clouds).value();
  EXPECT_THAT(merged.points.row(0), ElementsAre(2, 2, 1, 3, 3, 3));
  EXPECT_THAT(merged.sights.stations.row(0), ElementsAre(2, 2, 1));
  EXPECT_THAT(merged.sights.station_of, ElementsAre(1, kNoStation, kNoStation, 2, 2, 2));
  EXPECT_EQ(merged.sights.normals.cols(), 0);
  EXPECT_TRUE(CheckSights(merged.sights, 6).ok());
}

TEST(MergeCloudsTest, NormalsOfACloudWithoutAreNotKnown) {
  std::vector<PointCloud> clouds = {Cloud(1, 0), Cloud(2, 0)};
  clouds[1].sights.normals = Eigen::Matrix3Xf::Constant(3, 2, 7);
  const PointCloud merged = MergeClouds(clouds).value();
  ASSERT_EQ(merged.sights.normals.cols(), 3);
  EXPECT_TRUE(merged.sights.normals.col(0).array().isNaN().all());
  EXPECT_EQ(merged.sights.normals(2, 2), 7);
  EXPECT_TRUE(merged.sights.station_of.empty());
}

TEST(MergeCloudsTest, ColoursAreThereWhereEveryCloudHasThem) {
  std::vector<PointCloud> clouds = {Cloud(1, 0), Cloud(2, 0)};
  clouds[1].sights.colors = {{1, 2, 3}, {4, 5, 6}};
  EXPECT_TRUE(MergeClouds(clouds)->sights.colors.empty());
  clouds[0].sights.colors = {{7, 8, 9}};
  EXPECT_THAT(MergeClouds(clouds)->sights.colors,
              ElementsAre(Rgb{7, 8, 9}, Rgb{1, 2, 3}, Rgb{4, 5, 6}));
}

TEST(MergeCloudsTest, MoreStationsThanAreToldApartAreRefused) {
  const std::vector<PointCloud> clouds = {Cloud(1, kMostStations), Cloud(1, 1)};
  EXPECT_THAT(MergeClouds(clouds).status().message(), HasSubstr("4097 places"));
}

TEST(MergeCloudsTest, SightsOfOtherPointsAreRefused) {
  std::vector<PointCloud> clouds = {Cloud(2, 1)};
  clouds[0].sights.station_of.pop_back();
  EXPECT_EQ(MergeClouds(clouds).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
