#include "core/displacement/regularize/fill_heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

struct FillTest : ::testing::Test {
  Domain domain = MakeDomain(Sheet(0.4, 8), 4);  // control edges of 0.1
  std::vector<uint8_t> known = std::vector<uint8_t>(domain.size(), 1);
  std::vector<float> heights = std::vector<float>(domain.size(), 0.0f);

  void Set(const std::function<double(double, double)>& height,
           const std::function<bool(double, double)>& has_data) {
    for (int v = 0; v < domain.size(); ++v) {
      const double x = domain.limit.positions(0, v), y = domain.limit.positions(1, v);
      known[v] = has_data(x, y);
      heights[v] = known[v] ? static_cast<float>(height(x, y)) : 1e9f;  // to be overwritten
    }
    ASSERT_TRUE(FillHeights(domain.refinement, known, RunContext(), &heights).ok());
  }
  double WorstError(const std::function<double(double, double)>& height) const {
    double worst = 0;
    for (int v = 0; v < domain.size(); ++v) {
      worst = std::max(worst, std::abs(heights[v] - height(domain.limit.positions(0, v),
                                                           domain.limit.positions(1, v))));
    }
    return worst;
  }
};

TEST_F(FillTest, AHoleContinuesSlopeAndCurvatureOfItsRim) {
  const auto height_field = [](double x, double y) {
    return 0.01 + 0.1 * x + 0.3 * x * y - 0.2 * y * y;
  };
  Set(height_field, [](double x, double y) { return std::hypot(x, y) > 0.08; });
  // Over the hole the height_field varies by 0.016 and bends by 0.0013.
  EXPECT_LT(WorstError(height_field), 0.0012);
}

TEST_F(FillTest, ThereIsNoStepAtTheRim) {
  const auto height_field = [](double x, double) { return 0.02 * std::sin(20 * x); };
  Set(height_field, [](double x, double y) { return std::hypot(x, y) > 0.1; });
  double steepest = 0;
  for (const auto& edge : domain.refinement.levels.back().edge_vertices.colwise()) {
    if (known[edge[0]] && known[edge[1]]) continue;
    const double length =
        (domain.limit.positions.col(edge[0]) - domain.limit.positions.col(edge[1])).norm();
    steepest = std::max(steepest, std::abs(heights[edge[0]] - heights[edge[1]]) / length);
  }
  EXPECT_LT(steepest, 1.3 * 0.4);  // the height_field's own slope is 0.4
}

TEST_F(FillTest, BeyondTheRimOfAnOpenScanTheHeightIsHeld) {
  Set([](double, double) { return 0.01; }, [](double x, double) { return x < 0.25; });
  for (int v = 0; v < domain.size(); ++v) {
    EXPECT_NEAR(heights[v], 0.01, 0.0015) << domain.limit.positions(0, v);
  }
}

TEST_F(FillTest, FarFromAllDataItReturnsTowardsTheDomain) {
  Set([](double, double) { return 0.01; }, [](double x, double) { return x < -0.35; });
  float at_rim = 0, far = 0;
  for (int v = 0; v < domain.size(); ++v) {
    if (std::abs(domain.limit.positions(1, v)) > 0.1) continue;
    if (std::abs(domain.limit.positions(0, v) + 0.3) < 0.02) at_rim = heights[v];
    if (domain.limit.positions(0, v) > 0.35) far = heights[v];
  }
  EXPECT_GT(at_rim, 0.008f);
  EXPECT_LT(std::abs(far), 0.6f * at_rim);
}

// On the rim too, where a plate that is free to bend would extrapolate the noise.
TEST_F(FillTest, ScatteredHolesInNoiseStayWithinIt) {
  Random random(1);
  for (int v = 0; v < domain.size(); ++v) {
    heights[v] = static_cast<float>(Uniform(&random, -0.001, 0.001));
    known[v] = random() % 10 != 0;
  }
  ASSERT_TRUE(FillHeights(domain.refinement, known, RunContext(), &heights).ok());
  for (float height : heights) EXPECT_LT(std::abs(height), 0.002);
}

TEST_F(FillTest, KnownHeightsStayAndWithoutAnyAllAreZero) {
  std::vector<float> before(domain.size());
  for (int v = 0; v < domain.size(); ++v)
    before[v] = heights[v] = 0.001f * static_cast<float>(v % 7);
  for (int v = 0; v < domain.size(); v += 3) known[v] = 0;
  ASSERT_TRUE(FillHeights(domain.refinement, known, RunContext(), &heights).ok());
  for (int v = 0; v < domain.size(); ++v) {
    if (known[v]) {
      EXPECT_EQ(heights[v], before[v]);
    }
  }
  std::fill(known.begin(), known.end(), 0);
  ASSERT_TRUE(FillHeights(domain.refinement, known, RunContext(), &heights).ok());
  EXPECT_EQ(std::count(heights.begin(), heights.end(), 0.0f), domain.size());
  std::fill(known.begin(), known.end(), 1);
  heights = before;
  ASSERT_TRUE(FillHeights(domain.refinement, known, RunContext(), &heights).ok());
  EXPECT_EQ(heights, before);
}

TEST_F(FillTest, StopsWhenAsked) {
  known[5] = 0;
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  heights[6] = 0.01f;
  EXPECT_EQ(FillHeights(domain.refinement, known, context, &heights).code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
