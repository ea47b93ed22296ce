#include "core/displacement/regularize/height_bounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

// The limit is put on the sphere itself: that of a sphere's control mesh is none.
Domain SphereDomain(double radius, double side) {
  Domain domain = MakeDomain(Octahedron(radius, 2), 2);
  for (int v = 0; v < domain.size(); ++v) {
    const Eigen::Vector3d direction = domain.limit.positions.col(v).normalized();
    domain.limit.positions.col(v) = radius * direction;
    domain.limit.normals.col(v) = side * direction;
  }
  return domain;
}

std::vector<HeightBounds> Bounds(const Domain& domain, double most) {
  std::vector<HeightBounds> bounds;
  for (int v = 0; v < domain.size(); ++v) {
    bounds.push_back(BoundsOf(v, domain.rings, domain.limit, most));
  }
  return bounds;
}

TEST(BoundHeightsTest, ASphereMayShrinkToATenthOfItsRadiusAndGrowToTheLimit) {
  for (const HeightBounds& bound : Bounds(SphereDomain(0.02, 1), 0.05)) {
    EXPECT_NEAR(bound.lowest, -0.9 * 0.02, 1e-7);
    EXPECT_NEAR(bound.highest, 0.05, 1e-8);
  }
}

TEST(BoundHeightsTest, InsideOutTheBoundsChangePlaces) {
  for (const HeightBounds& bound : Bounds(SphereDomain(0.02, -1), 0.05)) {
    EXPECT_NEAR(bound.lowest, -0.05, 1e-8);
    EXPECT_NEAR(bound.highest, 0.9 * 0.02, 1e-7);
  }
}

// A trough along y: concave by 1 / 0.02 along x, flat along y. Its rim edges lie along both.
TEST(BoundHeightsTest, TheTightestDirectionCounts) {
  constexpr double kRadius = 0.02;
  Domain domain = MakeDomain(Sheet(0.03, 8), 2);
  for (int v = 0; v < domain.size(); ++v) {
    const double turn = domain.limit.positions(0, v) / kRadius;
    const double y = domain.limit.positions(1, v);
    domain.limit.positions.col(v) << kRadius * std::sin(turn), y, -kRadius * std::cos(turn);
    domain.limit.normals.col(v) << -std::sin(turn), 0, std::cos(turn);
  }
  int tight = 0;
  for (const HeightBounds& bound : Bounds(domain, 0.05)) {
    EXPECT_NEAR(bound.lowest, -0.05, 1e-8);
    EXPECT_GT(bound.highest, 0.9 * kRadius - 1e-7);
    tight += bound.highest < 0.9 * kRadius + 1e-4;
  }
  EXPECT_GT(tight, 0.9 * domain.size());  // all with an edge straight along x
}

TEST(BoundHeightsTest, APlaneIsBoundedByTheOptionNeverBeyondIt) {
  const Domain domain = MakeDomain(Sheet(0.3, 4), 2);
  for (const double most : {0.05, 0.1, 0.3}) {
    for (const HeightBounds& bound : Bounds(domain, most)) {
      EXPECT_LE(bound.highest, most);
      EXPECT_GE(bound.lowest, -most);
      EXPECT_NEAR(bound.highest, most, 1e-6);
    }
  }
}

}  // namespace
}  // namespace rilievo
