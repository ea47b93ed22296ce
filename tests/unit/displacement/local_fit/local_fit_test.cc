#include "core/displacement/local_fit/local_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/displacement/local_fit/normal_equations.h"
#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

constexpr double kHalf = 0.1;
constexpr int kSide = 21;
constexpr double kSpacing = 2 * kHalf / kSide * 1.128;

TEST(NormalEquationsTest, SolvesAndGivesTheVarianceOfTheFirstUnknown) {
  NormalEquations<3> equations;
  equations.matrix << 4, 0, 0, 1, 3, 0, 0.5, -1, 2;
  Eigen::Matrix3d full = equations.matrix.selfadjointView<Eigen::Lower>();
  equations.solution << 1, 2, 3;
  ASSERT_TRUE(equations.Solve());
  EXPECT_LT((full * equations.solution - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_NEAR(equations.inverse_first, full.inverse()(0, 0), 1e-12);
  NormalEquations<3> singular;
  singular.matrix.setOnes();
  singular.solution.setOnes();
  EXPECT_FALSE(singular.Solve());
}

// A height_field around the origin with noise along its normals.
struct NoisyHeightField {
  RayCloud cloud;
  std::vector<QueuedPoint> queue;
  NoisyHeightField(const std::function<double(double, double)>& height, double noise, int seed) {
    Random random(seed);
    const Points points = HeightFieldPoints(kHalf, kSide * kSide, &random, height);
    for (size_t i = 0; i < points.at.size(); ++i) {
      const Eigen::Vector3f p =
          (points.at[i] + noise * Gauss(&random) * points.normal[i]).cast<float>();
      const Eigen::Vector3f n = points.normal[i].cast<float>();
      cloud.points.push_back({{p[0], p[1], p[2]},
                              {n[0], n[1], n[2]},
                              static_cast<float>(kSpacing),
                              static_cast<float>(noise)});
      queue.push_back({static_cast<int>(i), p[0], p[1], p[2], 0});
    }
  }
  std::optional<LocalFit> Fit(const Eigen::Vector3d& foot_normal, double noise, double start) {
    LocalFitter fitter;
    fitter.SetPatch(queue, cloud);
    const MultiscaleFit view =
        fitter.FitScales(MakeRay(Eigen::Vector3d::Zero(), {0, 0, 1}),
                         {foot_normal.cast<float>(), static_cast<float>(start),
                          static_cast<float>(noise), static_cast<float>(kSpacing)});
    const auto window = SelectScale(view.ladder);
    if (!window) return std::nullopt;
    return SelectFit(view, *window);
  }
};

TEST(LocalFitTest, PlanesAreExact) {
  NoisyHeightField height_field([](double x, double y) { return 0.01 + 0.2 * x - 0.1 * y; }, 0, 1);
  const auto fit =
      height_field.Fit(Eigen::Vector3d(-0.2, 0.1, 1).normalized(), 0.15 * kSpacing, 0.012);
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->height, 0.01, 1e-7);
}

TEST(LocalFitTest, QuadricsAreExact) {
  NoisyHeightField height_field(
      [](double x, double y) { return 0.01 + 0.2 * x - 0.1 * y + 2 * x * x - x * y; }, 0, 1);
  const auto fit =
      height_field.Fit(Eigen::Vector3d(-0.2, 0.1, 1).normalized(), 0.15 * kSpacing, 0.012);
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->height, 0.01, 2e-6);
}

TEST(LocalFitTest, AveragesNoiseAndKnowsHowWell) {
  const double noise = 0.4 * kSpacing;
  double squares = 0, deviation = 0;
  constexpr int kRuns = 200;
  for (int seed = 0; seed < kRuns; ++seed) {
    NoisyHeightField height_field([](double x, double y) { return 0.5 * (x * x + y * y); }, noise,
                                  seed);
    const auto fit = height_field.Fit({0, 0, 1}, noise, 0.3 * noise);
    ASSERT_TRUE(fit.has_value());
    squares += fit->height * fit->height / kRuns;
    deviation += fit->deviation / kRuns;
  }
  EXPECT_LT(std::sqrt(squares), 0.25 * noise);
  EXPECT_NEAR(std::sqrt(squares), deviation, 0.5 * deviation);
}

TEST(LocalFitTest, DetailBeyondTheNoiseNarrowsTheWindow) {
  // A bump of six spacings width: the widest window would halve it.
  const double height = 0.6 * kSpacing, noise = 0.05 * kSpacing;
  NoisyHeightField height_field(
      [&](double x, double y) {
        return height * std::exp(-(x * x + y * y) / (2 * std::pow(1.5 * kSpacing, 2)));
      },
      noise, 3);
  const auto fit = height_field.Fit({0, 0, 1}, noise, height);
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->height, height, 3 * noise);
}

TEST(LocalFitTest, OutliersOfTheWindowAreDropped) {
  const double noise = 0.2 * kSpacing;
  NoisyHeightField height_field([](double, double) { return 0.0; }, noise, 4);
  for (size_t i = 0; i < height_field.queue.size(); i += 12) {
    height_field.cloud.points[i].position[2] += 1.4f * kSpacing;
  }
  const auto fit = height_field.Fit({0, 0, 1}, noise, 0);
  ASSERT_TRUE(fit.has_value());
  EXPECT_LT(std::abs(fit->height), 0.5 * noise);
}

TEST(LocalFitTest, ARidgeKeepsItsCrest) {
  const double noise = 0.25 * kSpacing;
  double mean = 0;
  constexpr int kRuns = 100;
  for (int seed = 0; seed < kRuns; ++seed) {
    NoisyHeightField height_field([](double x, double) { return -std::abs(x); }, noise, seed);
    const auto fit =
        height_field.Fit(Eigen::Vector3d(-1, 0, 1).normalized(), noise, -0.3 * kSpacing);
    ASSERT_TRUE(fit.has_value());
    mean += fit->height / kRuns;
  }
  // A plane through both sides within two spacings would lie 0.7 spacings
  // lower.
  EXPECT_LT(std::abs(mean), 0.25 * kSpacing);
}

// Points on a plane whose normals say that it bends beside the ray: wider windows are looked at.
TEST(LocalFitTest, NormalsAloneAreNoEdge) {
  const double noise = 0.2 * kSpacing;
  NoisyHeightField height_field([](double, double) { return 0.01; }, noise, 8);
  for (RayPoint& point : height_field.cloud.points) {
    if (point.position[0] < 0.3 * kSpacing) continue;
    point.normal[0] = std::sin(1.2f);
    point.normal[2] = std::cos(1.2f);
  }
  LocalFitter fitter;
  fitter.SetPatch(height_field.queue, height_field.cloud);
  const MultiscaleFit view = fitter.FitScales(
      MakeRay(Eigen::Vector3d::Zero(), {0, 0, 1}),
      {Eigen::Vector3f::UnitZ(), 0.01f, static_cast<float>(noise), static_cast<float>(kSpacing)});
  EXPECT_GE(view.ladder.count, 3);
}

TEST(LocalFitTest, TooFewPointsGiveNothing) {
  NoisyHeightField height_field([](double, double) { return 0.0; }, 0.001, 5);
  height_field.queue.resize(3);
  EXPECT_FALSE(height_field.Fit({0, 0, 1}, 0.001, 0).has_value());
  height_field.queue.clear();
  EXPECT_FALSE(height_field.Fit({0, 0, 1}, 0.001, 0).has_value());
}

}  // namespace
}  // namespace rilievo
