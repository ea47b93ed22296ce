#include "core/points/batched_nearest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/points/morton_order.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

Eigen::Matrix3Xd AlongCurve(const Eigen::Matrix3Xd& points) {
  const MortonOrder curve = ComputeMortonOrder(0.3 * points, RunContext{}).value();
  return points(Eigen::all, curve.order);
}

// Bit for bit what the index itself finds.
void ExpectAsOfIndex(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& places, int k) {
  const PointIndex index(points);
  BatchedNearest nearby(index, points, k);
  std::vector<int> expected(static_cast<size_t>(k));
  std::vector<double> squared(expected.size());
  const int64_t begin = std::min<int64_t>(3, places.cols());
  int64_t next = begin;
  nearby.OfEach(places, begin, places.cols(),
                [&](int64_t i, const int* found, const double* found_squared) {
                  ASSERT_EQ(i, next++);
                  index.Nearest(places.col(i), k, expected.data(), squared.data());
                  for (int j = 0; j < k; ++j) {
                    ASSERT_EQ(found[j], expected[j]) << i << " " << j;
                    ASSERT_EQ(found_squared[j], squared[j]) << i << " " << j;
                  }
                });
  EXPECT_EQ(next, places.cols());
}

TEST(BatchedNearestTest, TheCloudItself) {
  const Eigen::Matrix3Xd points = AlongCurve(TorusCloud(6000, 1).cloud.points);
  for (const int k : {1, 8, 17, 65, 300}) ExpectAsOfIndex(points, points, k);
}

TEST(BatchedNearestTest, PlacesOfAnotherDensity) {
  const Eigen::Matrix3Xd points = AlongCurve(TorusCloud(2000, 1).cloud.points);
  for (const int count : {2, 300, 20000}) {
    ExpectAsOfIndex(points, AlongCurve(TorusCloud(count, 2).cloud.points), 9);
  }
}

TEST(BatchedNearestTest, PlacesInNoOrder) {
  const Eigen::Matrix3Xd points = TorusCloud(2000, 1).cloud.points;
  ExpectAsOfIndex(points, points, 17);
  ExpectAsOfIndex(points, 40 * TorusCloud(300, 4).cloud.points, 5);
}

TEST(BatchedNearestTest, FewPoints) {
  const Eigen::Matrix3Xd points = SphereCloud(12, 1).cloud.points;
  for (const int k : {1, 12}) ExpectAsOfIndex(points, points, k);
}

// Lattice distances are equal by the dozen, and many points lie in the same place.
TEST(BatchedNearestTest, EquallyFarPoints) {
  Eigen::Matrix3Xd points(3, 4096);
  for (int i = 0; i < 4096; ++i) {
    points.col(i) = 0.0625 * Eigen::Vector3d(i % 64 / 2, i / 64, 0);
  }
  points = AlongCurve(points - 2 * Eigen::Vector3d(1, 1, 0).replicate(1, 4096));
  for (const int k : {2, 17, 40}) ExpectAsOfIndex(points, points, k);
}

// The k-th nearest point of the place before may be where that place is.
TEST(BatchedNearestTest, PlacesOnPoints) {
  Eigen::Matrix3Xd points(3, 200), places(3, 40);
  for (int i = 0; i < 200; ++i) points.col(i) = Eigen::Vector3d(0.01 * i, 0, 0);
  for (int i = 0; i < 40; ++i) {
    places.col(i) = Eigen::Vector3d(0.01 * i + 0.003, i % 10 == 9 ? 0 : 0.002, 0);
    if (i % 10 == 9) places.col(i) = points.col(i);
  }
  ExpectAsOfIndex(points, places, 1);
  points.middleCols(15, 9) = points.col(19).replicate(1, 9);
  ExpectAsOfIndex(points, places, 9);
}

// One place far from all others must not gather what lies close together.
TEST(BatchedNearestTest, AStrayPlaceBetweenDensePoints) {
  Eigen::Matrix3Xd points = AlongCurve(SphereCloud(5000, 1).cloud.points);
  Eigen::Matrix3Xd places = points.leftCols(600);
  for (int i = 0; i < 600; i += 97) places.col(i) *= 30;
  ExpectAsOfIndex(points, places, 17);
}

}  // namespace
}  // namespace rilievo
