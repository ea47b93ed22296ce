#include "core/scan/orientation/sight_votes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rilievo {
namespace {

// Points on a line along x with normals up.
OrientedCloud Line(int count) {
  OrientedCloud cloud;
  cloud.points.setZero(3, count);
  cloud.normals.setZero(3, count);
  for (int i = 0; i < count; ++i) {
    cloud.points(0, i) = i;
    cloud.normals(2, i) = 1;
  }
  return cloud;
}

TEST(SightVotesTest, AStationVotesByTheCosineOfItsSight) {
  PointSights sights;
  sights.stations.resize(3, 2);
  sights.stations << 0, 2, 0, 0, 5, -1;
  sights.station_of = {0, kNoStation, 1, 1};
  SightFigures figures;
  const SideVotes votes = StationVotes(sights, Line(4), &figures);
  ASSERT_EQ(votes.size(), 4u);
  EXPECT_FLOAT_EQ(votes[0], 1);
  EXPECT_EQ(votes[1], 0);
  EXPECT_FLOAT_EQ(votes[2], -1);
  EXPECT_FLOAT_EQ(votes[3], static_cast<float>(-std::sqrt(0.5)));
  EXPECT_EQ(figures.points, 3);
  sights.stations.resize(3, 0);
  EXPECT_TRUE(StationVotes(sights, Line(4), &figures).empty());
}

TEST(SightVotesTest, ANormalVotesWhenItsLengthIsOne) {
  PointSights sights;
  sights.normals.resize(3, 5);
  sights.normals << 0, 0, 0.6f, 3, NAN,  //
      0, 0, 0, 0, 0,                     //
      1, -1.04f, 0.8f, 4, 0;
  SightFigures figures;
  SideVotes votes = NormalVotes(sights, Line(5), &figures);
  EXPECT_FLOAT_EQ(votes[0], 1);
  EXPECT_FLOAT_EQ(votes[1], -1);
  EXPECT_FLOAT_EQ(votes[2], 0.8f);
  EXPECT_EQ(votes[3], 0) << "of length 5";
  EXPECT_EQ(votes[4], 0);
  EXPECT_EQ(figures.points, 4);
  EXPECT_EQ(figures.usable, 0.75);
  EXPECT_FLOAT_EQ(static_cast<float>(figures.alignment), 1);
}

TEST(SightVotesTest, VotesForEitherSideCancelOutWithinAComponent) {
  const std::vector<int> component = {0, 0, 1, 1};
  const std::vector<int8_t> signs = {1, 1, 1, -1};
  EXPECT_EQ(ConsistencyOf({1, 1, -1, 1}, {}, component, signs), 1);
  EXPECT_EQ(ConsistencyOf({1, -1, 1, 1}, {}, component, signs), 0);
  EXPECT_EQ(ConsistencyOf({1, 1, 1, 1}, {}, component, signs), 0.5);
  EXPECT_EQ(ConsistencyOf({0, 0, 0, 0}, {}, component, signs), 0);
  EXPECT_EQ(ConsistencyOf({1, -1, 0, 0}, {3, 1, 9, 9}, component, signs), 0.5);
}

TEST(SightVotesTest, AStationWeighsByTheSolidAngleOfAPoint) {
  OrientedCloud cloud = Line(3);
  cloud.spacing = {1, 1, 1};
  PointSights sights;
  sights.stations = Eigen::Vector3d(0, 0, 2);
  sights.station_of = {0, kNoStation, 0};
  EXPECT_EQ(StationWeights(sights, cloud), (std::vector<float>{0.25F, 0, 0.125F}));
  sights.stations = Eigen::Vector3d(0, 0, 0.1);
  EXPECT_EQ(StationWeights(sights, cloud)[0], 1);
  EXPECT_TRUE(StationWeights({}, cloud).empty());
}

TEST(SightVotesTest, BeliefTakesAllShares) {
  const SightFigures good = {.points = 9, .usable = 1, .alignment = 0.9, .consistency = 0.9};
  EXPECT_TRUE(IsBelieved(SightRule::kAuto, good));
  EXPECT_FALSE(IsBelieved(SightRule::kIgnore, good));
  for (double SightFigures::*share :
       {&SightFigures::usable, &SightFigures::alignment, &SightFigures::consistency}) {
    SightFigures bad = good;
    bad.*share = 0.3;
    EXPECT_FALSE(IsBelieved(SightRule::kAuto, bad));
    EXPECT_TRUE(IsBelieved(SightRule::kUse, bad));
  }
  EXPECT_FALSE(IsBelieved(SightRule::kUse, {}));
}

}  // namespace
}  // namespace rilievo
