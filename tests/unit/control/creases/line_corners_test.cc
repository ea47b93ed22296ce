#include "core/control/creases/line_corners.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/scans/random.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kRightAngle = std::numbers::pi / 2, kAngle = 50 * std::numbers::pi / 180;

CreaseChain ChainOf(int vertices, bool closed) {
  CreaseChain chain;
  chain.closed = closed;
  for (int i = 0; i < vertices; ++i) chain.vertices.push_back(i);
  for (int i = 0; i < (closed ? vertices : vertices - 1); ++i) chain.edges.push_back(i);
  return chain;
}

Eigen::Matrix3Xd Square(int steps) {
  Eigen::Matrix3Xd places(3, 4 * steps);
  for (int i = 0; i < 4 * steps; ++i) {
    const double part = static_cast<double>(i % steps) / steps;
    const Vector3d sides[] = {{part, 0, 0}, {1, part, 0}, {1 - part, 1, 0}, {0, 1 - part, 0}};
    places.col(i) = sides[i / steps];
  }
  return places;
}

TEST(CornersOfLine, ASquareHasFourAndAnOpenLineNoneAtItsEnds) {
  const Eigen::Matrix3Xd square = Square(10);
  EXPECT_THAT(CornersOfLine(square, ChainOf(40, true), kAngle, 0.05),
              ::testing::UnorderedElementsAre(0, 0, 10, 20, 30));  // the first closes the loop
  EXPECT_THAT(CornersOfLine(square, ChainOf(40, false), kAngle, 0.05),
              ::testing::UnorderedElementsAre(10, 20, 30));
}

// A corner of two steps, each too flat or as sharp as the other.
TEST(CornersOfLine, OfTwoWithinReachOneCounts) {
  Eigen::Matrix3Xd places(3, 6);
  places << -2, -1, 0, 0.1, 0.1, 0.1,  //
      0, 0, 0, 0.1, 1.1, 2.1,          //
      0, 0, 0, 0, 0, 0;
  EXPECT_THAT(CornersOfLine(places, ChainOf(6, false), kAngle, 1), ElementsAre(2));
  EXPECT_THAT(CornersOfLine(places, ChainOf(6, false), 1.01 * kRightAngle, 1), IsEmpty());
}

// As the definition says, by comparing all with all.
TEST(CornersOfLine, AreThoseOfBruteForce) {
  Random random(5);
  constexpr int kCount = 400;
  constexpr double kReach = 1.7;
  Eigen::Matrix3Xd places(3, kCount);
  Vector3d at = Vector3d::Zero();
  std::vector<double> along;
  double length = 0;
  for (int i = 0; i < kCount; ++i) {
    places.col(i) = at;
    along.push_back(length);
    const Vector3d step = Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized() *
                          (i % 7 == 0 ? 1.0 : 0.3);
    at += step;
    length += step.norm();
  }
  const CreaseChain chain = ChainOf(kCount, false);
  const auto place = [&](double s) -> Vector3d {
    for (int i = 1; i < kCount; ++i) {
      if (along[i] < s) continue;
      const double part = std::max(0.0, (s - along[i - 1]) / (along[i] - along[i - 1]));
      return places.col(i - 1) + part * (places.col(i) - places.col(i - 1));
    }
    return places.col(kCount - 1);
  };
  std::vector<double> turns(kCount, 0);
  for (int i = 1; i + 1 < kCount; ++i) {
    const Vector3d in = places.col(i) - place(along[i] - kReach);
    const Vector3d out = place(along[i] + kReach) - places.col(i);
    turns[i] = std::atan2(in.cross(out).norm(), in.dot(out));
  }
  std::vector<int> expected;
  for (int i = 0; i < kCount; ++i) {
    bool sharpest = turns[i] > kAngle;
    for (int j = 0; j < kCount; ++j) {
      sharpest &= j == i || turns[j] < turns[i] || std::abs(along[j] - along[i]) >= kReach;
    }
    if (sharpest) expected.push_back(i);
  }
  EXPECT_GT(expected.size(), 20u);
  EXPECT_THAT(CornersOfLine(places, chain, kAngle, kReach),
              ::testing::UnorderedElementsAreArray(expected));
}

}  // namespace
}  // namespace rilievo
