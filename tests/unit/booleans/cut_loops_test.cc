#include "core/booleans/cut_loops.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <random>

namespace rilievo {
namespace {

struct Flat {
  Eigen::Matrix2Xd points{2, 0};
  std::vector<std::vector<int>> loops;

  // A star of `count` points; clockwise where `turns` is -1.
  void AddLoop(const Eigen::Vector2d& center, double radius, int count, double turns,
               double jagged) {
    std::vector<int> loop;
    for (int i = 0; i < count; ++i) {
      const double angle = turns * 2 * std::numbers::pi * i / count;
      const double at = radius * (i % 2 == 0 ? 1 : 1 - jagged);
      points.conservativeResize(2, points.cols() + 1);
      points.rightCols(1) = center + at * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      loop.push_back(static_cast<int>(points.cols()) - 1);
    }
    loops.push_back(loop);
  }
  double Turn(int a, int b, int c) const {
    const Eigen::Vector2d u = points.col(b) - points.col(a), v = points.col(c) - points.col(a);
    return u.x() * v.y() - u.y() * v.x();
  }
};

// Every half-edge of a loop once, every diagonal once each way; returns the least double area of a
// triangle, and adds all areas up.
double CheckCut(const Flat& flat, double* area) {
  std::map<std::pair<int, int>, int> of_loops;
  std::map<int, int> of_diagonals;
  double least = 1e300;
  *area = 0;
  size_t corners = 0;
  for (const CutTriangle& triangle : CutLoops(flat.points, flat.loops)) {
    for (size_t k = 0; k < 3; ++k) {
      if (triangle.diagonals[k] >= 0) {
        ++of_diagonals[triangle.diagonals[k]];
      } else {
        ++of_loops[{triangle.corners[k], triangle.corners[(k + 1) % 3]}];
      }
    }
    const double turn = flat.Turn(triangle.corners[0], triangle.corners[1], triangle.corners[2]);
    least = std::min(least, turn);
    *area += turn / 2;
  }
  for (const std::vector<int>& loop : flat.loops) {
    corners += loop.size();
    for (size_t i = 0; i < loop.size(); ++i) {
      EXPECT_EQ((of_loops[{loop[i], loop[(i + 1) % loop.size()]}]), 1);
    }
  }
  EXPECT_EQ(of_loops.size(), corners);
  for (const auto& [diagonal, uses] : of_diagonals) EXPECT_EQ(uses, 2) << diagonal;
  return least;
}

double AreaOf(const Flat& flat) {
  double area = 0;
  for (const std::vector<int>& loop : flat.loops) {
    for (size_t i = 1; i + 1 < loop.size(); ++i) area += flat.Turn(loop[0], loop[i], loop[i + 1]);
  }
  return area / 2;
}

TEST(CutLoopsTest, StarsWithHolesAndIslands) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> part(0, 1);
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(i);
    Flat flat;
    flat.AddLoop({0, 0}, 10, 3 + i % 40, 1, 0.4 * part(random));
    flat.AddLoop({20, 1}, 3, 3 + i % 7, 1, 0.5 * part(random));
    for (int hole = 0; hole < i % 6; ++hole) {  // each in a cell of its own
      const Eigen::Vector2d center(2 * (hole % 3) - 2 + 0.3 * part(random), hole / 3 * 1.6 - 0.8);
      if (i % 40 < 3) continue;
      flat.AddLoop(center, 0.5, 3 + hole * i % 9, -1, 0.5 * part(random));
    }
    double area;
    EXPECT_GT(CheckCut(flat, &area), 0);
    EXPECT_NEAR(area, AreaOf(flat), 1e-9);
  }
}

TEST(CutLoopsTest, HoleInAnIslandInAHole) {
  Flat flat;
  flat.AddLoop({0, 0}, 10, 24, 1, 0);
  flat.AddLoop({0, 0}, 8, 24, -1, 0);
  flat.AddLoop({0, 0}, 6, 24, 1, 0);
  flat.AddLoop({0, 0}, 4, 24, -1, 0);
  double area;
  EXPECT_GT(CheckCut(flat, &area), 0);
  EXPECT_NEAR(area, AreaOf(flat), 1e-9);
}

TEST(CutLoopsTest, PointsInALineAreNoTrouble) {
  Flat flat;
  flat.points.resize(2, 12);
  std::vector<int> loop;
  for (int i = 0; i < 12; ++i) {
    const int side = i / 3, step = i % 3;
    const Eigen::Vector2d corners[] = {{0, 0}, {3, 0}, {3, 3}, {0, 3}};
    flat.points.col(i) = corners[side] + (corners[(side + 1) % 4] - corners[side]) * step / 3.0;
    loop.push_back(i);
  }
  flat.loops = {loop};
  double area;
  EXPECT_GT(CheckCut(flat, &area), 0);
  EXPECT_NEAR(area, 9, 1e-12);
}

// Loops without sense still come out whole.
TEST(CutLoopsTest, LoopsThatCrossOrCoincideAreCutWhole) {
  std::mt19937_64 random(4);
  std::uniform_int_distribution<int> step(0, 4);
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(i);
    Flat flat;
    for (int loop = 0; loop <= i % 4; ++loop) {
      flat.AddLoop({0, 0}, 1, 3 + step(random), 1, 0);
    }
    for (double& x : flat.points.reshaped()) x = step(random);
    double area;
    CheckCut(flat, &area);
  }
}

}  // namespace
}  // namespace rilievo
