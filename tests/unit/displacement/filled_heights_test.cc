#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>

#include "core/displacement/sample_displacement.h"
#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

using Field = std::function<double(double, double)>;

struct FilledHeightsTest : ::testing::Test {
  Domain domain = MakeDomain(Sheet(0.4, 8), 3);  // control edges of 0.1

  double x(int v) const { return domain.limit.positions(0, v); }
  double y(int v) const { return domain.limit.positions(1, v); }

  // The heights where points of a height field are left out but where `has_points`.
  DisplacementField Heights(const Field& height,
                            const std::function<bool(double, double)>& has_points) {
    Random random(1);
    const Points all = HeightFieldPoints(0.42, 10000, &random, height);
    Points points;
    for (size_t i = 0; i < all.at.size(); ++i) {
      if (has_points(all.at[i][0], all.at[i][1])) points.Add(all.at[i], all.normal[i]);
    }
    return Sample(MakeScan(points.Positions(), points.Normals(), 0), domain);
  }
};

TEST_F(FilledHeightsTest, AHoleContinuesSlopeAndCurvatureOfItsRim) {
  const Field height = [](double x, double y) {
    return 0.005 + 0.05 * x + 0.15 * x * y - 0.1 * y * y;
  };
  const DisplacementField field =
      Heights(height, [](double x, double y) { return std::hypot(x, y) > 0.08; });
  EXPECT_GT(field.filled, 50);
  // Over the hole the height varies by 0.008 and bends by 0.00065.
  for (int v = 0; v < domain.size(); ++v) {
    if (field.source[v] != HeightSource::kFilled) continue;
    EXPECT_NEAR(field.heights[v], height(x(v), y(v)), 0.0006) << x(v) << ", " << y(v);
  }
}

TEST_F(FilledHeightsTest, ThereIsNoStepAtTheRim) {
  const DisplacementField field =
      Heights([](double x, double) { return 0.02 * std::sin(20 * x); },
              [](double x, double y) { return std::hypot(x, y) > 0.1; });
  double steepest = 0;
  for (const auto& edge : domain.refinement.levels.back().edge_vertices.colwise()) {
    if (field.source[edge[0]] != HeightSource::kFilled &&
        field.source[edge[1]] != HeightSource::kFilled) {
      continue;
    }
    const double length = std::hypot(x(edge[0]) - x(edge[1]), y(edge[0]) - y(edge[1]));
    steepest =
        std::max(steepest, std::abs(field.heights[edge[0]] - field.heights[edge[1]]) / length);
  }
  EXPECT_GT(steepest, 0);
  EXPECT_LT(steepest, 1.3 * 0.4);  // the steepest slope of the field itself is 0.4
}

TEST_F(FilledHeightsTest, BeyondTheRimOfAnOpenScanTheHeightIsHeld) {
  const DisplacementField field =
      Heights([](double, double) { return 0.01; }, [](double x, double) { return x < 0.25; });
  EXPECT_GT(field.filled, 100);
  for (int v = 0; v < domain.size(); ++v) EXPECT_NEAR(field.heights[v], 0.01, 0.0015) << x(v);
}

TEST_F(FilledHeightsTest, FarFromAllPointsItReturnsTowardsTheDomain) {
  const DisplacementField field =
      Heights([](double, double) { return 0.01; }, [](double x, double) { return x < -0.35; });
  float at_rim = 0, far = 0;
  for (int v = 0; v < domain.size(); ++v) {
    if (std::abs(y(v)) > 0.1) continue;
    if (std::abs(x(v) + 0.3) < 0.02) at_rim = field.heights[v];
    if (x(v) > 0.35) far = field.heights[v];
  }
  EXPECT_GT(at_rim, 0.008f);
  EXPECT_LT(std::abs(far), 0.6f * at_rim);
}

}  // namespace
}  // namespace rilievo
