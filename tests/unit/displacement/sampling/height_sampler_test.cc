#include "core/displacement/sampling/height_sampler.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

struct Sampled {
  Scan scan;
  RayCloud cloud;
  explicit Sampled(const Points& points, double noise = 0)
      : scan(MakeScan(points.Positions(), points.Normals(), noise)),
        cloud(*PrepareRayCloud(scan.cloud, scan.graph, RunContext())) {}
};

// From the far side the walk may end there: then there is no height, never a wrong one.
TEST(HeightSamplerTest, FindsTheSurfaceFromAnyStartOnItsSide) {
  const Sampled sphere(SpherePoints(0.3, 5000));
  HeightSampler sampler(sphere.cloud, sphere.scan.graph, DisplacementOptions());
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d direction = SpiralDirection(i, 60);
    for (int start = i; start < 5000; start += 199) {
      const auto estimate = sampler.Pierce(MakeRay(0.27 * direction, direction), start, 0);
      if (sphere.scan.cloud.normals.col(start).dot(direction) > 0) {
        ASSERT_TRUE(estimate.has_value()) << i << " from " << start;
      }
      if (!estimate) continue;
      EXPECT_NEAR(estimate->height, 0.03, 1e-6);
      EXPECT_FALSE(estimate->fitted);
      const Eigen::Map<const Eigen::Vector3f> foot(sphere.cloud.points[estimate->foot].position);
      EXPECT_LT((foot - (0.3 * direction).cast<float>()).norm(), estimate->spacing);
    }
  }
}

// A rod as thick as some four points stand apart.
TEST(HeightSamplerTest, AThinRodIsRoundBetweenItsPoints) {
  constexpr double kRadius = 0.01;
  Random random(4);
  Points points;
  for (int i = 0; i < 2000; ++i) {
    const double angle = Uniform(&random, 0, 2 * M_PI);
    const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0);
    points.Add(kRadius * out + Eigen::Vector3d(0, 0, Uniform(&random, -0.5, 0.5)), out);
  }
  const Sampled rod(points);
  HeightSampler sampler(rod.cloud, rod.scan.graph, DisplacementOptions());
  double squares = 0;
  int hits = 0;
  for (int i = 0; i < 300; ++i) {
    const double angle = 2.4 * i;
    const Eigen::Vector3d out(std::cos(angle), std::sin(angle), 0), from(0, 0, i / 400.0 - 0.375);
    int start = 0;
    double squared = 0;
    rod.scan.index.Nearest(from + kRadius * out, 1, &start, &squared);
    const auto estimate = sampler.Pierce(MakeRay(from + 0.9 * kRadius * out, out), start, 0);
    if (!estimate) continue;
    ++hits;
    squares += std::pow(estimate->height - 0.1 * kRadius, 2);
  }
  EXPECT_GT(hits, 280);
  EXPECT_LT(std::sqrt(squares / hits), 0.05 * kRadius);
}

TEST(HeightSamplerTest, OneNormalThatLeansDoesNotBendAPlane) {
  Random random(5);
  Points points = HeightFieldPoints(0.2, 6400, &random, [](double, double) { return 0.0; });
  for (size_t i = 0; i < points.normal.size(); i += 40) {
    points.normal[i] = Eigen::Vector3d(std::sin(0.7), 0, std::cos(0.7));
  }
  const Sampled sheet(points);
  HeightSampler sampler(sheet.cloud, sheet.scan.graph, DisplacementOptions());
  double squares = 0;
  for (int i = 0; i < 400; ++i) {
    const Ray ray = MakeRay({0.3 * (i % 20) / 20 - 0.15, 0.3 * (i / 20) / 20 - 0.15, 0}, {0, 0, 1});
    const auto estimate = sampler.Pierce(ray, 0, 0);
    ASSERT_TRUE(estimate.has_value());
    squares += std::pow(estimate->height / estimate->spacing, 2) / 400;
  }
  EXPECT_LT(std::sqrt(squares), 0.02);
}

TEST(HeightSamplerTest, OfTwoSheetsThatFaceAlikeTheReferenceDecides) {
  Random random(1);
  const auto flat = [](double, double) { return 0.0; };
  Points points = HeightFieldPoints(0.2, 6400, &random, flat);
  const Points upper = HeightFieldPoints(0.2, 6400, &random, flat);
  for (size_t i = 0; i < upper.at.size(); ++i) {
    points.Add(upper.at[i] + Eigen::Vector3d(0, 0, 0.02), upper.normal[i]);
  }
  const Sampled sheets(points);
  HeightSampler sampler(sheets.cloud, sheets.scan.graph, DisplacementOptions());
  const Ray ray = MakeRay({0.013, 0.021, 0}, {0, 0, 1});
  int ids[2];
  double distances[2];
  sheets.scan.index.Nearest({0.013, 0.021, 0}, 1, &ids[0], distances);
  sheets.scan.index.Nearest({0.013, 0.021, 0.02}, 1, &ids[1], distances);
  EXPECT_NEAR(sampler.Pierce(ray, ids[0], 0)->height, 0, 1e-5);
  EXPECT_NEAR(sampler.Pierce(ray, ids[1], 0.02f)->height, 0.02, 1e-5);
}

TEST(HeightSamplerTest, NothingInAHoleOrBeyondTheHeightAllowed) {
  Random random(2);
  Points all = HeightFieldPoints(0.2, 6400, &random, [](double, double) { return 0.0; }), points;
  for (size_t i = 0; i < all.at.size(); ++i) {
    if (all.at[i].head<2>().norm() > 0.03) points.Add(all.at[i], all.normal[i]);
  }
  const Sampled sheet(points);
  HeightSampler sampler(sheet.cloud, sheet.scan.graph, DisplacementOptions());
  EXPECT_FALSE(sampler.Pierce(MakeRay({0, 0, 0}, {0, 0, 1}), 0, 0).has_value());
  EXPECT_FALSE(sampler.Pierce(MakeRay({0.1, 0.1, 0.06}, {0, 0, 1}), 0, 0).has_value());
  EXPECT_TRUE(sampler.Pierce(MakeRay({0.1, 0.1, 0.04}, {0, 0, 1}), 0, 0).has_value());
}

TEST(HeightSamplerTest, RefiningTakesTheNoiseOutOfAWholeBlock) {
  Random random(3);
  const double noise = 0.002;
  Points points = HeightFieldPoints(0.2, 6400, &random, [](double, double) { return 0.0; });
  for (Eigen::Vector3d& p : points.at) p[2] += noise * Gauss(&random);
  const Sampled sheet(points, noise);
  HeightSampler sampler(sheet.cloud, sheet.scan.graph, DisplacementOptions());
  std::vector<RaySample> block;
  for (int i = 0; i < 400; ++i) {
    const Ray ray = MakeRay({0.3 * (i % 20) / 20 - 0.15, 0.3 * (i / 20) / 20 - 0.15, 0}, {0, 0, 1});
    const auto estimate = sampler.Pierce(ray, 0, 0);
    ASSERT_TRUE(estimate.has_value());
    EXPECT_TRUE(IsNoisy(sheet.cloud.points[estimate->foot], DisplacementOptions()));
    block.push_back({ray, *estimate});
  }
  sampler.Refine(block);
  double squares = 0;
  for (const RaySample& sample : block) EXPECT_TRUE(sample.estimate.fitted);
  for (const RaySample& sample : block) squares += std::pow(sample.estimate.height, 2) / 400;
  EXPECT_LT(std::sqrt(squares), 0.3 * noise);
}

}  // namespace
}  // namespace rilievo
