#include "core/codec/mesh/gate_geometry.h"

#include <cmath>
#include <numbers>

#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

TEST(GateGeometryTest, AnglesAreAnglesAtEveryScale) {
  for (int scale : {300, 100000, 100000000}) {
    for (int degrees = 0; degrees <= 180; ++degrees) {
      const double radians = degrees * std::numbers::pi / 180;
      const GridPoint corner = {scale / 7, -scale / 5, scale / 3};
      const GridPoint p = {corner[0] + scale, corner[1], corner[2]};
      const GridPoint q = {corner[0] + static_cast<int>(scale * std::cos(radians)),
                           corner[1] + static_cast<int>(scale * std::sin(radians)), corner[2]};
      EXPECT_NEAR(CornerAngle(corner, p, q) * 180.0 / 2048, degrees, 1.5) << scale;
      EXPECT_EQ(CornerAngle(corner, p, q), CornerAngle(corner, q, p));
    }
  }
  EXPECT_EQ(CornerAngle({5, 5, 5}, {5, 5, 5}, {7, 5, 5}), 0);
}

TEST(GateGeometryTest, RelativeDistancesAreLogarithms) {
  const GridPoint a = {0, 0, 0}, b = {1000, 0, 0};
  EXPECT_EQ(RelativeDistance(a, a, a, b), 0);
  EXPECT_EQ(RelativeDistance({0, 1001, 0}, a, a, b), 6);  // 32 times 1, six bits
  EXPECT_EQ(RelativeDistance({0, 2002, 0}, a, a, b), 8);
  EXPECT_EQ(RelativeDistance({0, 100000000, 0}, a, a, b), 11);
  EXPECT_EQ(RelativeDistance({0, 3, 0}, a, a, a), 9);  // no edge at all
}

// The extremes of the format must not overflow; a sanitizer build checks that here.
TEST(GateGeometryTest, TakesTheWholeRange) {
  const int32_t m = kMaxCoordinate;
  const GridPoint low = {-m, -m, -m}, high = {m, m, m}, mixed = {m, -m, m};
  for (const GridPoint& p : {low, high, mixed}) {
    for (const GridPoint& q : {low, high, mixed}) {
      const GridPoint r = Parallelogram(p, q, low);
      EXPECT_LE(std::abs(r[0]), 3 * int64_t{m});
      EXPECT_LE(EdgeBits(p, q), 29);
      const int angle = CornerAngle(p, q, r);
      EXPECT_GE(angle, 0);
      EXPECT_LE(angle, 2048);
      EXPECT_LE(RelativeDistance(r, p, p, q), 11);
    }
  }
}

TEST(GateGeometryTest, NormalIsThatOfTheTriangle) {
  for (int32_t size : {1, 100, kMaxCoordinate}) {
    const std::array<int64_t, 3> up = GateNormal({0, 0, 0}, {size, 0, 0}, {0, size, 0});
    EXPECT_EQ(up[0], 0);
    EXPECT_EQ(up[1], 0);
    EXPECT_GT(up[2], 0);
    const std::array<int64_t, 3> tilted = GateNormal({0, 0, 0}, {size, 0, size}, {0, size, 0});
    EXPECT_EQ(tilted[0], -tilted[2]);
    EXPECT_LT(tilted[2], int64_t{1} << 29);
  }
  const std::array<int64_t, 3> none = GateNormal({5, 5, 5}, {5, 5, 5}, {7, 7, 7});
  EXPECT_EQ(none, (std::array<int64_t, 3>{0, 0, 0}));
}

}  // namespace
}  // namespace rilievo
