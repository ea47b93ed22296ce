#include "core/displacement/plate/height_problem.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "core/displacement/plate/filter_lengths.h"
#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

// A sheet under points of z = height(x, y) with noise.
struct Setting {
  Domain domain;
  Scan scan;
  std::vector<PointFoot> feet;

  Setting(int count, double noise, const std::function<double(double, double)>& height)
      : domain(MakeDomain(Sheet(0.3, 8), 3)) {
    Random random(1);
    Points points = HeightFieldPoints(0.32, count, &random, height);
    for (auto& at : points.at) at.z() += noise * Gauss(&random);
    scan = MakeScan(points.Positions(), points.Normals(), noise);
    feet = *FindFeet(scan.cloud, domain.refinement, domain.rings, domain.limit,
                     DisplacementOptions(), Threads(2));
  }
  HeightProblem Problem() const {
    HeightProblem problem(
        scan.cloud, domain.refinement, feet,
        *BuildPlateLevels(domain.refinement, domain.rings, domain.limit, Threads(2)));
    EXPECT_TRUE(problem.Assemble(0, Threads(2)).ok());
    return problem;
  }
  double RmsInside(const std::vector<float>& heights,
                   const std::function<double(double, double)>& truth) const {
    double squares = 0;
    int count = 0;
    for (size_t v = 0; v < heights.size(); ++v) {
      const auto at = domain.limit.positions.col(v);
      if (at.head<2>().cwiseAbs().maxCoeff() > 0.2) continue;
      squares += std::pow(heights[v] - truth(at[0], at[1]), 2);
      ++count;
    }
    return std::sqrt(squares / count);
  }
};

// What points say against `heights` of a level: the gradient, by vertex.
std::vector<float> GradientOf(const PlateLevel& level, const PointTerm& term,
                              const std::vector<float>& heights) {
  std::vector<float> gradient(heights.size());
  for (int v = 0; v < level.vertex_count(); ++v) {
    double sum = double{term.diagonal[v]} * heights[v] - term.right_side[v];
    for (uint32_t s = level.begin[v]; s < level.begin[v + 1]; ++s) {
      sum += double{term.slot[s]} * heights[level.neighbor[s]];
    }
    gradient[v] = static_cast<float>(sum);
  }
  return gradient;
}

TEST(HeightEquations, CoarseLevelsFeelWhatTheirProlongedHeightsFeel) {
  const auto ramp = [](double x, double y) { return 0.003 * x - 0.002 * y; };
  const Setting setting(5000, 0.0005, ramp);
  const LoopRefinement& refinement = setting.domain.refinement;
  const std::vector<PlateLevel> levels =
      *BuildPlateLevels(refinement, setting.domain.rings, setting.domain.limit, Threads(2));
  const int finest = refinement.max_level();
  Random random(1);
  const auto uniform = [&random](float low, float high) {
    return std::uniform_real_distribution<float>(low, high)(random);
  };
  std::vector<float> weights(setting.feet.size());
  for (float& weight : weights) weight = uniform(0, 1);
  std::vector<uint8_t> measured(levels[finest].vertex_count());
  for (uint8_t& flag : measured) flag = uniform(0, 1) < 0.7f ? 1 : 0;
  for (const std::vector<uint8_t>& flags : {std::vector<uint8_t>(), measured}) {
    const std::vector<PointTerm> terms = *AssemblePointTerms(
        refinement, levels, 0, setting.feet, weights, /*domain_weight=*/0, flags, Threads(2));
    for (int l = 0; l < finest; ++l) {
      std::vector<float> heights(levels[l].vertex_count());
      for (float& height : heights) height = uniform(-0.01f, 0.01f);
      const std::vector<float> coarse = GradientOf(levels[l], terms[l], heights);
      const std::vector<float> fine = Restrict(
          refinement, finest, l,
          GradientOf(levels[finest], terms[finest], Prolong(refinement, l, finest, heights)));
      double largest = 0;
      for (const float value : fine) largest = std::max(largest, std::abs(double{value}));
      for (size_t v = 0; v < coarse.size(); ++v) {
        ASSERT_NEAR(coarse[v], fine[v], 1e-5 * largest) << l << " " << v;
      }
    }
  }
}

TEST(HeightProblem, AWaveIsDampedAsTheFilterSays) {
  // 1 / (1 + (k t spacing)^4) of the wave is left.
  constexpr double kWaveNumber = 2 * M_PI / 0.1, kAmplitude = 0.002;
  const auto wave = [](double x, double) { return kAmplitude * std::sin(kWaveNumber * x); };
  const Setting setting(22500, 0, wave);
  const HeightProblem problem = setting.Problem();
  const double spacing = setting.scan.cloud.median_spacing;
  for (const double t : {1.0, 3.0, 5.0}) {
    const std::vector<float> heights =
        *problem.SolveUpTo(problem.finest(), {static_cast<float>(t)}, Threads(2));
    const double left = 1 / (1 + std::pow(kWaveNumber * t * spacing, 4));
    const auto damped = [&](double x, double y) { return left * wave(x, y); };
    EXPECT_LT(setting.RmsInside(heights, damped), 0.05 * kAmplitude) << t << " " << left;
  }
}

TEST(HeightProblem, ARegionHasThePointsNearestToItsVertex) {
  const Setting setting(10000, 0, [](double, double) { return 0.002; });
  const HeightProblem problem = setting.Problem();
  for (int level = 0; level <= problem.finest(); ++level) {
    const std::vector<int> region = *problem.RegionOfPoints(level, Threads(2));
    const double edge = problem.levels()[level].mean_edge;
    int found = 0;
    for (size_t p = 0; p < region.size(); ++p) {
      EXPECT_EQ(region[p] >= 0, setting.feet[p].found());
      if (region[p] < 0) continue;
      ++found;
      ASSERT_LT(region[p], problem.levels()[level].vertex_count());
      const Eigen::Vector3d point = setting.scan.cloud.points.col(p);
      if (point.head<2>().cwiseAbs().maxCoeff() > 0.25) continue;  // the rim is not even
      const Eigen::Vector3d off = setting.domain.limit.positions.col(region[p]) - point;
      EXPECT_LT(off.head<2>().norm(), 0.8 * edge) << level;
    }
    EXPECT_GT(found, 5000);
  }
}

TEST(HeightProblem, APointFarOffLosesItsWeight) {
  Setting setting(10000, 0, [](double, double) { return 0.01; });
  size_t outlier = 0;
  for (size_t p = 0; p < setting.feet.size(); ++p) {
    if (setting.feet[p].found() && setting.scan.cloud.points.col(p).head<2>().norm() < 0.01) {
      outlier = p;
    }
  }
  setting.feet[outlier].offset += 0.03f;
  HeightProblem problem = setting.Problem();
  const std::vector<float> heights = *problem.SolveUpTo(problem.finest(), {3.0f}, Threads(2));
  ASSERT_TRUE(problem.Reweigh(heights, Threads(2)).ok());
  EXPECT_LT(problem.weights()[outlier], 0.05);
  EXPECT_GT(problem.weights()[outlier + 1], 0.5);
}

TEST(HeightProblem, OfTwoSheetsTheNearerToTheDomainIsMeant) {
  Setting setting(10000, 0, [](double, double) { return 0.002; });
  for (size_t p = 0; p < setting.feet.size(); p += 2) setting.feet[p].offset += 0.03f;
  HeightProblem problem = setting.Problem();
  problem.PreferNearPoints();
  ASSERT_TRUE(problem.Assemble(0, Threads(2)).ok());
  const std::vector<float> heights = *problem.SolveUpTo(problem.finest(), {1.0f}, Threads(2));
  EXPECT_LT(setting.RmsInside(heights, [](double, double) { return 0.002; }), 0.001);
}

TEST(ChooseFilterLengths, NoiseWantsLongOnesAndDetailShortOnes) {
  // Left: fine waves, clean. Right: flat and noisy.
  const auto waves = [](double x, double y) {
    return x < 0 ? 0.003 * std::sin(60 * x) * std::sin(60 * y) : 0.0;
  };
  Setting setting(22500, 0, waves);
  Random random(3);
  for (size_t p = 0; p < setting.feet.size(); ++p) {
    if (setting.scan.cloud.points(0, p) > 0) {
      setting.feet[p].offset += static_cast<float>(0.004 * Gauss(&random));
    }
  }
  const HeightProblem problem = setting.Problem();
  const std::vector<float> lengths = ChooseFilterLengths(problem, Threads(2))->lengths;
  double clean = 0, noisy = 0;
  int clean_count = 0, noisy_count = 0;
  for (int v = 0; v < setting.domain.size(); ++v) {
    const auto at = setting.domain.limit.positions.col(v);
    if (std::abs(at[0]) < 0.06 || at.cwiseAbs().maxCoeff() > 0.25) continue;
    (at[0] < 0 ? clean : noisy) += std::log(lengths[v]);
    ++(at[0] < 0 ? clean_count : noisy_count);
  }
  EXPECT_LT(std::exp(clean / clean_count), 1);
  EXPECT_GT(std::exp(noisy / noisy_count), 3);
}

TEST(ChooseFilterLengths, TellsWhatOfTheNoiseIsLeft) {
  const double sigma = 0.002;
  Setting setting(22500, 0,
                  [](double x, double y) { return 0.02 * std::sin(8 * x) * std::sin(8 * y); });
  std::vector<float> clean;
  Random random(4);
  for (PointFoot& foot : setting.feet) {
    clean.push_back(foot.offset);
    foot.offset += static_cast<float>(sigma * Gauss(&random));
  }
  HeightProblem problem = setting.Problem();
  const FilterLengths filter = *ChooseFilterLengths(problem, Threads(2));
  const std::vector<float> heights =
      *problem.SolveUpTo(problem.finest(), filter.lengths, Threads(2));
  double squares = 0, count = 0;
  for (size_t p = 0; p < setting.feet.size(); ++p) {
    const PointFoot& foot = setting.feet[p];
    if (!foot.found()) continue;
    double error = -clean[p];
    for (int k = 0; k < 3; ++k) error += foot.weight[k] * heights[foot.corner[k]];
    squares += error * error;
    ++count;
  }
  const double left = std::sqrt(squares / count) / sigma;
  EXPECT_LT(left, 0.3);
  EXPECT_GT(std::sqrt(filter.leverage), left / 1.5);
  EXPECT_LT(std::sqrt(filter.leverage), left * 1.5);
}

}  // namespace
}  // namespace rilievo
