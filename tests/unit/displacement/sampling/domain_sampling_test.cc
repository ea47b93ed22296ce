#include "core/displacement/sampling/domain_sampling.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

struct NoisySphere : ::testing::Test {
  static constexpr double kNoise = 0.002;
  NoisySphere() {
    Random random(1);
    Points points = SpherePoints(0.3, 10000);
    for (size_t i = 0; i < points.at.size(); ++i) {
      points.at[i] += kNoise * Gauss(&random) * points.normal[i];
    }
    scan = MakeScan(points.Positions(), points.Normals(), kNoise);
    cloud = *PrepareRayCloud(scan.cloud, scan.graph, RunContext());
  }
  DomainSampling Make() {
    return DomainSampling(cloud, scan.graph, scan.index, domain.refinement, domain.rings,
                          domain.limit, options, context);
  }
  double Rms(const HeightSamples& samples) const {
    double squares = 0;
    for (int v = 0; v < domain.size(); ++v) {
      const double truth =
          SphereHeight(domain.limit.positions.col(v), domain.limit.normals.col(v), 0.3);
      squares += std::pow(samples.height[v] - truth, 2) / domain.size();
    }
    return std::sqrt(squares);
  }
  Scan scan = {{}, PointIndex(Eigen::Matrix3Xd::Zero(3, 1)), {}};
  RayCloud cloud;
  Domain domain = MakeDomain(Octahedron(0.295, 2), 3);
  DisplacementOptions options;
  RunContext context;
};

TEST_F(NoisySphere, EachPassBringsTheHeightsNearerToTheTruth) {
  DomainSampling sampling = Make();
  ASSERT_TRUE(sampling.IntersectNormals(0.5).ok());
  const double pierced = Rms(sampling.samples());
  EXPECT_LT(pierced, kNoise);
  ASSERT_TRUE(sampling.RefineNoisy().ok());
  EXPECT_LT(Rms(sampling.samples()), 0.6 * pierced);
  for (int v = 0; v < domain.size(); ++v) {
    EXPECT_TRUE(sampling.samples().measured[v]);
    EXPECT_TRUE(sampling.samples().fitted[v]);
    EXPECT_LT(sampling.samples().deviation[v], kNoise);
  }
}

TEST_F(NoisySphere, DespikingMeasuresASpikeAgain) {
  DomainSampling sampling = Make();
  ASSERT_TRUE(sampling.IntersectNormals(0.5).ok());
  ASSERT_TRUE(sampling.RefineNoisy().ok());
  HeightSamples& samples = sampling.samples();
  const double before = Rms(samples);
  const VertexRings rings = BuildVertexRings(domain.refinement.levels.back());
  // None next to another: two spikes would tell what to expect of each other.
  std::vector<uint8_t> near(domain.size(), 0);
  std::vector<int> spikes;
  for (int v = 10; v < domain.size(); v += 97) {
    if (near[v]) continue;
    spikes.push_back(v);
    for (int r = rings.neighbor_begin[v]; r < rings.neighbor_begin[v + 1]; ++r) {
      near[rings.neighbors[r]] = 1;
    }
  }
  for (const int v : spikes) samples.height[v] += 0.03f;
  EXPECT_GT(Rms(samples), 2 * before);
  ASSERT_TRUE(sampling.Despike().ok());
  for (const int v : spikes) {
    EXPECT_TRUE(samples.measured[v]);
    EXPECT_TRUE(samples.fitted[v]);
  }
  EXPECT_LT(Rms(samples), 1.1 * before);
}

// It is on the line between the other two.
TEST_F(NoisySphere, ASpikeBetweenTwoSpikesIsMeasuredAgainAsWell) {
  DomainSampling sampling = Make();
  ASSERT_TRUE(sampling.IntersectNormals(0.5).ok());
  ASSERT_TRUE(sampling.RefineNoisy().ok());
  HeightSamples& samples = sampling.samples();
  const VertexRings rings = BuildVertexRings(domain.refinement.levels.back());
  int tried = 0, kept = 0;
  for (int v = 500; v < domain.size(); v += 400) {
    const int first = rings.neighbor_begin[v], valence = rings.neighbor_begin[v + 1] - first;
    ASSERT_EQ(valence, 6);
    const HeightSamples before = samples;
    for (const int spike : {v, rings.neighbors[first], rings.neighbors[first + 3]}) {
      samples.height[spike] += 0.03f;
    }
    ASSERT_TRUE(sampling.Despike().ok());
    ++tried;
    if (samples.measured[v]) {
      ++kept;
      EXPECT_NEAR(samples.height[v], before.height[v], 2 * kNoise);
    }
    samples = before;
  }
  EXPECT_GT(kept, 0.8 * tried);
}

TEST_F(NoisySphere, WhatThePointsDenyIsMeasuredAgainThoughItsRingIsUnsure) {
  DomainSampling sampling = Make();
  ASSERT_TRUE(sampling.IntersectNormals(0.5).ok());
  ASSERT_TRUE(sampling.RefineNoisy().ok());
  HeightSamples& samples = sampling.samples();
  const int vertex = domain.size() / 2;
  const float before = samples.height[vertex];
  samples.height[vertex] += 0.03f;
  samples.deviation.assign(samples.deviation.size(), 0.02f);
  ASSERT_TRUE(sampling.Despike().ok());
  EXPECT_TRUE(samples.measured[vertex]);
  EXPECT_NEAR(samples.height[vertex], before, 2 * kNoise);
}

TEST_F(NoisySphere, ProgressGrowsToItsEnd) {
  std::vector<double> fractions;
  context.progress = [&](const Progress& progress) { fractions.push_back(progress.fraction); };
  DomainSampling sampling = Make();
  ASSERT_TRUE(sampling.IntersectNormals(0.5).ok());
  ASSERT_FALSE(fractions.empty());
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_DOUBLE_EQ(fractions.back(), 0.5);
}

}  // namespace
}  // namespace rilievo
