#include "core/displacement/local_fit/fit_sums.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/base/wide_registers.h"

namespace rilievo {
namespace {

// Points of a window, with as many more as are read beyond them, of weight 0.
struct Window {
  std::vector<float> u, v, height, weight;
  int count;

  explicit Window(int points) : count(points) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> within(-2, 2);
    for (int i = 0; i < count + kWideLanes; ++i) {
      u.push_back(within(random));
      v.push_back(within(random));
      height.push_back(within(random));
      weight.push_back(i < count ? std::abs(within(random)) : 0);
    }
  }
  FitPoints Points(float scale) const {
    return {u.data(), v.data(), height.data(), weight.data(), count, scale};
  }
};

constexpr int kPowers[][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}, {3, 0}, {2, 1},
                              {1, 2}, {0, 3}, {4, 0}, {3, 1}, {2, 2}, {1, 3}, {0, 4}};

double PlainSum(const Window& window, double scale, int monomial, bool with_height) {
  double sum = 0;
  for (int i = 0; i < window.count; ++i) {
    const double u = scale * window.u[i], v = scale * window.v[i];
    const double weight = window.weight[i] * std::max(0.0, 1 - u * u - v * v);
    sum += weight * std::pow(u, kPowers[monomial][0]) * std::pow(v, kPowers[monomial][1]) *
           (with_height ? window.height[i] : 1);
  }
  return sum;
}

TEST(FitSumsTest, EachIsThatOfOnePointAfterTheOther) {
  for (const int count : {0, 1, 7, 8, 9, 160}) {
    const Window window(count);
    for (const float scale : {0.4f, 0.7f}) {
      const FitSums plane = SumForPlane(window.Points(scale));
      const FitSums quadric = SumForQuadric(window.Points(scale));
      for (int m = 0; m < 15; ++m) {
        const double truth = PlainSum(window, scale, m, false);
        EXPECT_NEAR(quadric.monomials[m], truth, 1e-4) << m;
        EXPECT_NEAR(plane.monomials[m], m < 6 ? truth : 0, 1e-4) << m;
      }
      for (int m = 0; m < 6; ++m) {
        const double truth = PlainSum(window, scale, m, true);
        EXPECT_NEAR(quadric.heights[m], truth, 1e-4) << m;
        EXPECT_NEAR(plane.heights[m], m < 3 ? truth : 0, 1e-4) << m;
      }
    }
  }
}

#if defined(__x86_64__)
// Lane by lane, then the lanes: the order that every version keeps, whatever its registers.
float SumInLanes(const Window& window, float scale, int monomial) {
  float lanes[kWideLanes] = {};
  for (int i = 0; i < window.count; i += kWideLanes) {
    for (int lane = 0; lane < kWideLanes; ++lane) {
      const float u = window.u[i + lane] * scale, v = window.v[i + lane] * scale;
      const float weight = window.weight[i + lane] * std::max(0.0f, 1 - u * u - v * v);
      const float wu = weight * u, wv = weight * v;
      const float terms[] = {weight, wu, wv, wu * u, wu * v, wv * v};
      lanes[lane] += terms[monomial];
    }
  }
  float parts[kWideLanes / 2];
  for (int k = 0; k < 4; ++k) parts[k] = lanes[k] + lanes[k + 4];
  return (parts[0] + parts[2]) + (parts[1] + parts[3]);
}

TEST(FitSumsTest, EveryVersionGivesTheSameBits) {
  for (const int count : {1, 7, 8, 9, 160}) {
    const Window window(count);
    const FitSums plane = SumForPlane(window.Points(0.7f));
    const FitSums quadric = SumForQuadric(window.Points(0.7f));
    for (int m = 0; m < 6; ++m) {
      EXPECT_EQ(plane.monomials[m], SumInLanes(window, 0.7f, m)) << m;
      EXPECT_EQ(quadric.monomials[m], SumInLanes(window, 0.7f, m)) << m;
    }
  }
}
#endif

TEST(FitSumsTest, ProductsOfMonomialsAreMonomials) {
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < 6; ++b) {
      const int product = MonomialOfProduct(a, b);
      EXPECT_EQ(kPowers[product][0], kPowers[a][0] + kPowers[b][0]);
      EXPECT_EQ(kPowers[product][1], kPowers[a][1] + kPowers[b][1]);
    }
  }
}

}  // namespace
}  // namespace rilievo
