#include "core/geometry/station_table.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace rilievo {
namespace {

TEST(StationTableTest, APlaceIsHeldOnce) {
  StationTable table;
  const Eigen::Vector3d a(1, 2, 3), b(4, 5, 6);
  for (const Eigen::Vector3d& place : {a, a, b, a, b}) table.Add(place);
  table.Add(Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  PointSights sights;
  table.Finish(&sights);
  ASSERT_EQ(sights.stations.cols(), 2);
  EXPECT_EQ(sights.stations.col(0), a);
  EXPECT_EQ(sights.stations.col(1), b);
  EXPECT_EQ(sights.station_of, (std::vector<uint16_t>{0, 0, 1, 0, 1, kNoStation}));
}

TEST(StationTableTest, NoPlaceIsNoStation) {
  StationTable table;
  table.Add(Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()));
  PointSights sights;
  table.Finish(&sights);
  EXPECT_EQ(sights.stations.cols(), 0);
  EXPECT_TRUE(sights.station_of.empty());
}

TEST(StationTableTest, TheWayOfASensorBecomesPlacesAlongIt) {
  StationTable table;
  constexpr int kCount = 300'000;
  const auto place = [](int i) {
    const double t = 1.0 * i / kCount;
    return Eigen::Vector3d(500'000 + 4000 * t, 5'000'000 + 300 * std::sin(9 * t), 900);
  };
  for (int i = 0; i < kCount; ++i) table.Add(place(i));
  PointSights sights;
  table.Finish(&sights);
  EXPECT_GT(sights.stations.cols(), 500);
  EXPECT_LE(sights.stations.cols(), kMostStations);
  ASSERT_EQ(sights.station_of.size(), static_cast<size_t>(kCount));
  for (int i = 0; i < kCount; i += 7) {
    ASSERT_LT((sights.stations.col(sights.station_of[i]) - place(i)).norm(), 0.002 * 4000) << i;
  }
}

// Places that grow beyond any grid, and such as differ by the smallest number there is.
TEST(StationTableTest, EndsForAnyPlaces) {
  StationTable wide, narrow;
  for (int i = 0; i < 20'000; ++i) {
    wide.Add(Eigen::Vector3d::Constant(std::ldexp(1.0 + 1e-5 * i, i % 2000 - 1000)));
    narrow.Add(Eigen::Vector3d::Constant(i * std::numeric_limits<double>::denorm_min()));
  }
  for (StationTable* table : {&wide, &narrow}) {
    PointSights sights;
    table->Finish(&sights);
    EXPECT_LE(sights.stations.cols(), kMostStations);
    EXPECT_TRUE(CheckSights(sights, 20'000).ok());
  }
}

}  // namespace
}  // namespace rilievo
