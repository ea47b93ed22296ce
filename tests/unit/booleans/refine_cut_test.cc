#include "core/booleans/refine_cut.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

namespace rilievo {
namespace {

// A square with a round hole of `count` points.
struct Plate {
  Eigen::Matrix2Xd points;
  std::vector<std::vector<int>> loops;

  Plate(int count, double radius) : points(2, 4 + count), loops(2) {
    points.leftCols<4>() << -1, 1, 1, -1, -1, -1, 1, 1;
    loops[0] = {0, 1, 2, 3};
    for (int i = 0; i < count; ++i) {
      const double angle = -2 * std::numbers::pi * i / count;
      points.col(4 + i) = radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      loops[1].push_back(4 + i);
    }
  }
};

double Turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

struct Refined {
  std::vector<Eigen::Vector2d> points;
  std::vector<CutTriangle> triangles;
  double area = 0, thin = 0;  // thin: share of the triangles with an angle below 15 degrees
  size_t added = 0;
};

Refined Refine(const Plate& plate, bool add_points) {
  Refined refined;
  refined.triangles = CutLoops(plate.points, plate.loops);
  for (const auto point : plate.points.colwise()) refined.points.push_back(point);
  for (const Eigen::Vector2d& point : RefineCut(plate.points, add_points, &refined.triangles)) {
    refined.points.push_back(point);
    ++refined.added;
  }
  for (const CutTriangle& triangle : refined.triangles) {
    Eigen::Vector2d p[3];
    for (size_t k = 0; k < 3; ++k) p[k] = refined.points[static_cast<size_t>(triangle.corners[k])];
    EXPECT_GT(Turn(p[0], p[1], p[2]), 0);
    refined.area += Turn(p[0], p[1], p[2]) / 2;
    bool thin = false;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector2d u = p[(k + 1) % 3] - p[k], v = p[(k + 2) % 3] - p[k];
      thin = thin || u.normalized().dot(v.normalized()) > std::cos(std::numbers::pi / 12);
    }
    refined.thin += thin ? 1. / static_cast<double>(refined.triangles.size()) : 0;
  }
  return refined;
}

TEST(RefineCutTest, TheLoopsAndTheAreaStay) {
  for (const bool add_points : {false, true}) {
    const Plate plate(48, .3);
    const Refined refined = Refine(plate, add_points);
    std::map<std::pair<int, int>, int> loops;
    std::map<int, int> diagonals;
    for (const CutTriangle& triangle : refined.triangles) {
      for (size_t k = 0; k < 3; ++k) {
        if (triangle.diagonals[k] >= 0) {
          ++diagonals[triangle.diagonals[k]];
        } else {
          ++loops[{triangle.corners[k], triangle.corners[(k + 1) % 3]}];
        }
      }
    }
    EXPECT_EQ(loops.size(), 52u);
    for (int i = 0; i < 48; ++i) EXPECT_EQ((loops[{4 + i, 4 + (i + 1) % 48}]), 1);
    for (const auto& [diagonal, uses] : diagonals) EXPECT_EQ(uses, 2) << diagonal;
    const double hole = 24 * .3 * .3 * std::sin(2 * std::numbers::pi / 48);
    EXPECT_NEAR(refined.area, 4 - hole, 1e-12);
  }
}

// No corner of a triangle lies within the circle around the triangle across a diagonal.
TEST(RefineCutTest, DiagonalsAreDelaunay) {
  const Plate plate(24, .5);
  const Refined refined = Refine(plate, false);
  std::map<int, std::vector<std::pair<size_t, size_t>>> sides;
  for (size_t t = 0; t < refined.triangles.size(); ++t) {
    for (size_t k = 0; k < 3; ++k) {
      const int diagonal = refined.triangles[t].diagonals[k];
      if (diagonal >= 0) sides[diagonal].emplace_back(t, k);
    }
  }
  EXPECT_EQ(sides.size(), 28u);  // (3 * 28 triangles - 28 edges of loops) / 2
  for (const auto& [diagonal, both] : sides) {
    double angles = 0;
    for (const auto& [t, k] : both) {
      const auto& c = refined.triangles[t].corners;
      const auto at = [&](size_t i) -> const Eigen::Vector2d& {
        return refined.points[static_cast<size_t>(c[i % 3])];
      };
      const Eigen::Vector2d u = at(k) - at(k + 2), v = at(k + 1) - at(k + 2);
      angles += std::acos(u.normalized().dot(v.normalized()));
    }
    EXPECT_LE(angles, std::numbers::pi + 1e-6);
  }
}

TEST(RefineCutTest, PointsAddedMakeTrianglesRounder) {
  const Plate plate(96, .2);
  const Refined plain = Refine(plate, false), dense = Refine(plate, true);
  EXPECT_EQ(plain.added, 0u);
  EXPECT_GT(dense.added, 100u);
  EXPECT_GT(plain.thin, .9);
  EXPECT_LT(dense.thin, .2);
}

}  // namespace
}  // namespace rilievo
