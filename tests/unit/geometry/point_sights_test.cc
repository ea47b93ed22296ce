#include "core/geometry/point_sights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace rilievo {
namespace {

using ::testing::HasSubstr;

PointSights ThreePoints() {
  PointSights sights;
  sights.stations = Eigen::Matrix3Xd::Identity(3, 2);
  sights.station_of = {1, kNoStation, 0};
  sights.normals = Eigen::Matrix3Xf::Identity(3, 3);
  sights.colors = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  return sights;
}

TEST(PointSightsTest, ChosenPointsTakeTheirsAlong) {
  const int columns[] = {2, 0};
  const PointSights chosen = SightsOf(ThreePoints(), columns);
  EXPECT_EQ(chosen.station_of, (std::vector<uint16_t>{0, 1}));
  EXPECT_EQ(chosen.normals.col(0), ThreePoints().normals.col(2));
  EXPECT_EQ(chosen.colors, (std::vector<Rgb>{{7, 8, 9}, {1, 2, 3}}));
  EXPECT_EQ(chosen.stations, ThreePoints().stations);
  PointSights kept = ThreePoints();
  const uint8_t keep[] = {0, 1, 1};
  KeepSights(keep, &kept);
  EXPECT_EQ(kept.station_of, (std::vector<uint16_t>{kNoStation, 0}));
  EXPECT_EQ(kept.normals.col(1), ThreePoints().normals.col(2));
  EXPECT_EQ(kept.colors, (std::vector<Rgb>{{4, 5, 6}, {7, 8, 9}}));
  EXPECT_EQ(SightsOf({}, columns).normals.cols(), 0) << "of nothing comes nothing";
}

TEST(PointSightsTest, WhatDoesNotFitIsRefusedWithFieldValueAndRemedy) {
  EXPECT_TRUE(CheckSights(ThreePoints(), 3).ok());
  EXPECT_TRUE(CheckSights({}, 3).ok());
  const auto refused = [](PointSights sights, int64_t points) {
    return std::string(CheckSights(sights, points).message());
  };
  EXPECT_THAT(refused(ThreePoints(), 4), HasSubstr("3 station numbers for 4 points"));
  PointSights sights = ThreePoints();
  sights.station_of[2] = 2;
  EXPECT_THAT(refused(sights, 3), HasSubstr("point 2 names station 2 of 2; count from 0"));
  sights = ThreePoints();
  sights.stations(0, 1) = NAN;
  EXPECT_THAT(refused(sights, 3), HasSubstr("station 1 is not finite"));
  sights = ThreePoints();
  sights.normals.conservativeResize(3, 2);
  EXPECT_THAT(refused(sights, 3), HasSubstr("2 normals for 3 points"));
  sights = ThreePoints();
  sights.colors.pop_back();
  EXPECT_THAT(refused(sights, 3), HasSubstr("2 colours for 3 points"));
  sights = ThreePoints();
  sights.stations.setZero(3, kMostStations + 1);
  EXPECT_THAT(refused(sights, 3), HasSubstr("4097 places; at most 4096"));
}

}  // namespace
}  // namespace rilievo
