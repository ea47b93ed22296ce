#include "core/points/point_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <stop_token>
#include <utility>

#include "tests/unit/points/brute_force.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

TEST(PointIndexTest, NearestMatchesBruteForce) {
  const Eigen::Matrix3Xd points = TorusCloud(800, 1).cloud.points;
  const PointIndex index(points);
  EXPECT_EQ(index.size(), 800);
  Random random(2);
  for (int query = 0; query < 100; ++query) {
    const Eigen::Vector3d position = 1.5 * RandomDirection(&random);
    const auto expected = BruteForce(points, position);
    for (const int k : {20, 150, 799, 800, 900}) {
      std::vector<int> indices(static_cast<size_t>(k));
      std::vector<double> squared(indices.size());
      const int found = std::min(k, 800);
      ASSERT_EQ(index.Nearest(position, k, indices.data(), squared.data()), found);
      for (int j = 0; j < found; ++j) {
        EXPECT_EQ(indices[j], expected[j].second);
        EXPECT_DOUBLE_EQ(squared[j], expected[j].first);
      }
      // Those alone that are no farther off than the middle one of them.
      const double most_squared = expected[found / 2].first;
      const int near = index.Nearest(position, k, indices.data(), squared.data(), most_squared);
      ASSERT_EQ(near, found / 2 + 1);
      for (int j = 0; j < near; ++j) EXPECT_EQ(indices[j], expected[j].second);
    }
  }
}

TEST(PointIndexTest, AsksForMoreThanThereAre) {
  const PointIndex index(SphereCloud(5, 3).cloud.points);
  int indices[9];
  double squared[9];
  EXPECT_EQ(index.Nearest(Eigen::Vector3d(2, 0, 0), 9, indices, squared), 5);
  const PointIndex one(Eigen::Matrix3Xd(Eigen::Vector3d(1, 2, 3)));
  EXPECT_EQ(one.Nearest(Eigen::Vector3d::Zero(), 1, indices, squared), 1);
  EXPECT_EQ(indices[0], 0);
  EXPECT_EQ(squared[0], 14);
}

TEST(PointIndexTest, EquallyFarPointsComeByIndex) {
  Eigen::Matrix3Xd points(3, 200);
  for (int i = 0; i < 200; ++i) {
    points.col(i) = (i % 2 ? 1.0 : -1.0) * Eigen::Vector3d::Unit(i / 2 % 3);
  }
  const PointIndex index(points);
  int indices[50];
  double squared[50];
  ASSERT_EQ(index.Nearest(Eigen::Vector3d::Zero(), 50, indices, squared), 50);
  for (int j = 0; j < 50; ++j) EXPECT_EQ(indices[j], j);
}

// So many points stand in several trees; shuffled, every tree holds points of every place.
TEST(PointIndexTest, LargeSetsMatchBruteForce) {
  constexpr int kManyPoints = 1100000;
  const Eigen::Matrix3Xd ordered = SphereCloud(kManyPoints, 11).cloud.points;
  std::vector<int> order(kManyPoints);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  for (const Eigen::Matrix3Xd& points : {ordered, Eigen::Matrix3Xd(ordered(Eigen::all, order))}) {
    const PointIndex index = PointIndex::Build(points, RunContext{}).value();
    for (const Eigen::Vector3d& position :
         {Eigen::Vector3d(points.col(7)), Eigen::Vector3d(points.col(kManyPoints - 1)),
          Eigen::Vector3d(0.01, 0, 0), Eigen::Vector3d(0.2, -0.3, 9)}) {
      const auto expected = BruteForce(points, position);
      int indices[20];
      double squared[20];
      ASSERT_EQ(index.Nearest(position, 20, indices, squared), 20);
      for (int j = 0; j < 20; ++j) {
        EXPECT_EQ(indices[j], expected[j].second);
        EXPECT_DOUBLE_EQ(squared[j], expected[j].first);
      }
    }
  }
}

TEST(PointIndexTest, TheBuildStops) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(PointIndex::Build(SphereCloud(100, 9).cloud.points, context).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(PointIndexTest, WithoutACopyOfThePointsTheAnswersAreTheSame) {
  const Eigen::Matrix3Xd points = TorusCloud(5000, 3).cloud.points;
  const PointIndex copied(points);
  const PointIndex over = PointIndex::BuildOver(points, RunContext{}).value();
  Random random(4);
  for (int query = 0; query < 200; ++query) {
    const Eigen::Vector3d position = 1.2 * RandomDirection(&random);
    std::vector<int> a(20), b(20);
    std::vector<double> squared_a(20), squared_b(20);
    EXPECT_EQ(copied.Nearest(position, 20, a.data(), squared_a.data()), 20);
    EXPECT_EQ(over.Nearest(position, 20, b.data(), squared_b.data()), 20);
    EXPECT_EQ(a, b);
    EXPECT_EQ(squared_a, squared_b);
  }
}

TEST(PointIndexTest, NearestOfEachAndMoves) {
  const Eigen::Matrix3Xd points = SphereCloud(3000, 4).cloud.points;
  PointIndex index(points);
  const PointIndex moved = std::move(index);
  const auto nearest = moved.NearestOfEach(points, RunContext{});
  ASSERT_TRUE(nearest.ok());
  for (int i = 0; i < 3000; ++i) ASSERT_EQ((*nearest)[i], i);
}

TEST(PointIndexTest, WithinMatchesBruteForce) {
  const Eigen::Matrix3Xd points = TorusCloud(3000, 5).cloud.points;
  const PointIndex index(points);
  Random random(6);
  for (int query = 0; query < 100; ++query) {
    const Eigen::Vector3d position = 1.5 * RandomDirection(&random);
    const double radius = random.Uniform(0, 0.8);
    std::vector<int> expected, found;
    for (int i = 0; i < 3000; ++i) {
      if ((points.col(i) - position).norm() < radius) expected.push_back(i);
    }
    const int count = static_cast<int>(expected.size());
    ASSERT_TRUE(index.Within(position, radius, count, &found));
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, expected);
    if (count > 0) {
      EXPECT_FALSE(index.Within(position, radius, count - 1, &found));
    }
  }
}

}  // namespace
}  // namespace rilievo
