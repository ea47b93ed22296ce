#include "core/surface/closest_point_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "core/surface/triangle_distance.h"
#include "gtest/gtest.h"
#include "tests/unit/surface/test_shapes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Many sizes of triangle in a cloud: slivers, points, overlaps, everything a tree can meet.
Shape TriangleSoup(int count, double spread) {
  Shape shape;
  shape.vertices.resize(3, 3 * count);
  shape.triangles.resize(3, count);
  for (int f = 0; f < count; ++f) {
    const double size = std::pow(10, -2 + 2 * CounterUnit(900000 + f)) * spread;
    for (int k = 0; k < 3; ++k) {
      shape.vertices.col(3 * f + k) =
          spread * CounterPoint(f) + size * CounterPoint(100000 + 3 * f + k);
    }
    if (f % 17 == 0) shape.vertices.col(3 * f + 1) = shape.vertices.col(3 * f);
    shape.triangles.col(f) << 3 * f, 3 * f + 1, 3 * f + 2;
  }
  return shape;
}

double BruteForce(const Shape& shape, const Vector3d& p) {
  double best = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < shape.triangles.cols(); ++f) {
    best = std::min(best, SquaredDistanceToTriangle(p, shape.vertices.col(shape.triangles(0, f)),
                                                    shape.vertices.col(shape.triangles(1, f)),
                                                    shape.vertices.col(shape.triangles(2, f))));
  }
  if (shape.triangles.cols() == 0) {
    best = (shape.vertices.colwise() - p).colwise().squaredNorm().minCoeff();
  }
  return best;
}

TEST(ClosestPointTreeTest, AgreesWithBruteForce) {
  for (int count : {1, 2, 3, 4, 5, 8, 9, 17, 100, 3000}) {
    for (bool points : {false, true}) {
      Shape shape = TriangleSoup(count, 1);
      if (points) shape.triangles.resize(3, 0);
      const auto tree = ClosestPointTree::Build(shape.vertices, shape.triangles, RunContext());
      ASSERT_TRUE(tree.ok());
      int hint = -1;
      for (int i = 0; i < 300; ++i) {
        const Vector3d p = (i % 3 == 0 ? 10.0 : 1.2) * CounterPoint(7000000 + i);
        const double expected = BruteForce(shape, p);
        const ClosestPointTree::Hit cold = tree->Closest(p);
        EXPECT_TRUE(tree->HasWithin(p, 1.001 * std::sqrt(expected) + 1e-9));
        EXPECT_FALSE(tree->HasWithin(p, 0.999 * std::sqrt(expected) - 1e-9));
        const ClosestPointTree::Hit warm = tree->Closest(p, hint);
        ASSERT_NEAR(cold.squared_distance, expected, 1e-12 * (1 + expected)) << count;
        ASSERT_EQ(warm.squared_distance, cold.squared_distance);
        hint = warm.item;
      }
    }
  }
}

TEST(ClosestPointTreeTest, BroodsChangeNoDistance) {
  // Few and many broods, and a number of triangles that is not a multiple of theirs.
  for (const auto& [count, children_per_face] :
       {std::pair(16, 16), {160, 16}, {6400, 64}, {6400, 4}, {63, 4}}) {
    const Shape shape = TriangleSoup(count, 1);
    const auto sorted = ClosestPointTree::Build(shape.vertices, shape.triangles, RunContext());
    const auto tree =
        ClosestPointTree::Build(shape.vertices, shape.triangles, RunContext(), children_per_face);
    ASSERT_TRUE(sorted.ok() && tree.ok());
    const std::set<int> all(tree->source().begin(), tree->source().end());
    EXPECT_EQ(static_cast<int>(all.size()), count);
    for (int i = 0; i < 300; ++i) {
      const Vector3d p = (i % 3 == 0 ? 10.0 : 1.2) * CounterPoint(7000000 + i);
      const ClosestPointTree::Hit hit = tree->Closest(p);
      ASSERT_EQ(hit.squared_distance, sorted->Closest(p).squared_distance) << count;
      ASSERT_EQ(hit.squared_distance, tree->SquaredDistanceTo(hit.item, p));
    }
  }
}

// Map coordinates: boxes in float would be decimetres wide there, were they not relative.
TEST(ClosestPointTreeTest, StaysExactFarFromTheOrigin) {
  Shape shape = TriangleSoup(2000, 0.5);
  const Vector3d offset(500000, 4600000, 1000);
  shape.vertices.colwise() += offset;
  const auto tree = ClosestPointTree::Build(shape.vertices, shape.triangles, RunContext());
  for (int i = 0; i < 200; ++i) {
    const Vector3d p = offset + 0.6 * CounterPoint(8000000 + i);
    EXPECT_NEAR(std::sqrt(tree->Closest(p).squared_distance), std::sqrt(BruteForce(shape, p)),
                1e-8);
  }
}

TEST(ClosestPointTreeTest, TakesAnyScale) {
  for (double scale : {1e-30, 1e-6, 1e12, 1e30}) {
    const Shape shape = TriangleSoup(500, scale);
    const auto tree = ClosestPointTree::Build(shape.vertices, shape.triangles, RunContext());
    for (int i = 0; i < 100; ++i) {
      const Vector3d p = 1.5 * scale * CounterPoint(9000000 + i);
      EXPECT_NEAR(tree->Closest(p).squared_distance / (scale * scale),
                  BruteForce(shape, p) / (scale * scale), 1e-12);
    }
    const Vector3d far = Vector3d(1e20, 0, 0) * scale;
    EXPECT_NEAR(std::sqrt(tree->Closest(far).squared_distance) / scale, 1e20, 1e7);
  }
}

TEST(ClosestPointTreeTest, CoincidentPointsAreNoTrouble) {
  const Eigen::Matrix3Xd points = Vector3d(0.1, 0.2, 0.3).replicate(1, 1000);
  const auto tree = ClosestPointTree::Build(points, {}, RunContext());
  EXPECT_EQ(tree->Closest({0.1, 0.2, 0.3}).squared_distance, 0);
  EXPECT_NEAR(tree->Closest({1.1, 0.2, 0.3}).squared_distance, 1, 1e-12);
}

TEST(ClosestPointTreeTest, NumbersItemsOnceAndTheSameForAnyThreads) {
  const Shape shape = TriangleSoup(20000, 1);
  RunContext one, two;
  one.threads = 1;
  two.threads = 2;
  const auto a = ClosestPointTree::Build(shape.vertices, shape.triangles, one);
  const auto b = ClosestPointTree::Build(shape.vertices, shape.triangles, two);
  EXPECT_EQ(a->source(), b->source());
  std::vector<int> sorted = a->source();
  std::sort(sorted.begin(), sorted.end());
  for (int i = 0; i < a->item_count(); ++i) ASSERT_EQ(sorted[i], i);
}

TEST(ClosestPointTreeTest, TheNearestFewAreThoseOfASearchOfAll) {
  Eigen::Matrix3Xd points(3, 700);
  for (int i = 0; i < 700; ++i) points.col(i) = CounterPoint(i % 600);  // some twice
  const auto tree = ClosestPointTree::Build(points, {}, RunContext()).value();
  for (int q = 0; q < 200; ++q) {
    const Vector3d place = 1.5 * CounterPoint(5000 + q);
    std::vector<double> all;
    for (const auto point : points.colwise()) all.push_back((point - place).squaredNorm());
    std::sort(all.begin(), all.end());
    std::array<ClosestPointTree::Hit, 5> hits;
    ASSERT_EQ(tree.Nearest(place, hits), 5);
    std::set<int> items;
    for (size_t k = 0; k < hits.size(); ++k) {
      EXPECT_NEAR(hits[k].squared_distance, all[k], 1e-12);
      EXPECT_EQ(tree.SquaredDistanceTo(hits[k].item, place), hits[k].squared_distance);
      EXPECT_TRUE(items.insert(hits[k].item).second);
    }
    // Hints are what was found near by, at the very place, or anything.
    for (const double off : {0.0, 0.01, 1.0}) {
      std::array<ClosestPointTree::Hit, 5> hinted;
      tree.Nearest(place + off * Vector3d::UnitX(), hinted);
      ASSERT_EQ(tree.Nearest(place, hinted, true), 5);
      for (size_t k = 0; k < hits.size(); ++k) {
        EXPECT_EQ(hinted[k].squared_distance, hits[k].squared_distance);
      }
    }
  }
  std::vector<ClosestPointTree::Hit> more(800);
  EXPECT_EQ(tree.Nearest(Vector3d::Zero(), more), 700);
}

}  // namespace
}  // namespace rilievo
