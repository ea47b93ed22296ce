#include "core/booleans/grid_predicates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace rilievo {
namespace {

GridPoint At(int64_t x, int64_t y, int64_t z, uint32_t id) { return {{x, y, z}, id}; }

TEST(GridPredicatesTest, SideIsThatOfTheCounterClockwiseFace) {
  const GridTriangle flat = {At(0, 0, 0, 0), At(5, 0, 0, 1), At(0, 5, 0, 2)};
  EXPECT_EQ(SideOf(flat, At(1, 1, 1, 3)), 1);
  EXPECT_EQ(SideOf(flat, At(1, 1, -1, 3)), -1);
}

// A single step out of the plane of a triangle as large as the grid.
TEST(GridPredicatesTest, TellsOneStepAcrossTheWholeGrid) {
  const int64_t most = kMostGridCoordinate;
  const GridTriangle wide = {At(-most, -most, -most, 0), At(most, most - 1, most, 1),
                             At(most, -most, most, 2)};
  const GridPoint middle = At(1, 0, 0, 3), other = At(0, 0, 1, 4);
  EXPECT_EQ(SideOf(wide, middle), -SideOf(wide, other));
}

// With all four in a plane, in a line, or at a place, as with points that are not: swapping two
// changes the side.
TEST(GridPredicatesTest, TiesAreBrokenTheSameWayInAnyOrder) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 2000; ++i) {
    std::uniform_int_distribution<int64_t> step(0, i % 3);
    std::vector<GridPoint> p;
    for (uint32_t k = 0; k < 4; ++k) {
      p.push_back(At(step(random), step(random), i % 2 == 0 ? 0 : step(random),
                     k + 4 * static_cast<uint32_t>(i)));
    }
    const int side = SideOf({p[0], p[1], p[2]}, p[3]);
    EXPECT_EQ(SideOf({p[1], p[0], p[2]}, p[3]), -side);
    EXPECT_EQ(SideOf({p[1], p[2], p[0]}, p[3]), side);
    EXPECT_EQ(SideOf({p[3], p[1], p[2]}, p[0]), -side);
    EXPECT_EQ(SideOf({p[0], p[3], p[2]}, p[1]), -side);
  }
}

TEST(GridPredicatesTest, CrossingsLieInTheOrderAlongTheEdge) {
  std::mt19937_64 random(6);
  std::uniform_int_distribution<int64_t> step(-3, 3);
  const GridPoint p = At(-9, 0, 0, 0), q = At(9, 0, 0, 1);
  std::vector<EdgeCrossing> crossings;
  for (uint32_t id = 2; crossings.size() < 60; id += 3) {
    const GridTriangle triangle = {At(step(random), step(random), step(random), id),
                                   At(step(random), step(random), step(random), id + 1),
                                   At(step(random), step(random), step(random), id + 2)};
    if (Meets(p, q, triangle)) crossings.emplace_back(p, q, triangle);
  }
  for (const EdgeCrossing& a : crossings) {
    EXPECT_FALSE(a.Before(a));
    for (const EdgeCrossing& b : crossings) {
      if (&a == &b) continue;
      EXPECT_NE(a.Before(b), b.Before(a));
      if (a.parameter() < b.parameter()) {
        EXPECT_TRUE(a.Before(b));
      }
      for (const EdgeCrossing& c : crossings) {
        if (a.Before(b) && b.Before(c)) {
          EXPECT_TRUE(a.Before(c));
        }
      }
    }
  }
}

TEST(GridPredicatesTest, ParameterIsWhereThePlaneIs) {
  const GridTriangle upright = {At(2, -50, -50, 2), At(2, 50, -50, 3), At(2, 0, 90, 4)};
  const EdgeCrossing crossing(At(0, 0, 0, 0), At(8, 1, 1, 1), upright);
  EXPECT_DOUBLE_EQ(crossing.parameter(), 0.25);
}

}  // namespace
}  // namespace rilievo
