#include "core/displacement/regularize/despike_heights.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

struct SheetHeights : ::testing::Test {
  // 65 x 65 vertices, evenly spaced by 0.3 / 32, a little less than the spacing of the points.
  Domain domain = MakeDomain(Sheet(0.3, 64), 0);
  const MeshTopology& finest = domain.refinement.levels.back();
  VertexRings rings = BuildVertexRings(finest);
  HeightSamples samples{static_cast<size_t>(domain.size())};

  void Set(const std::function<double(double, double)>& height) {
    for (int v = 0; v < domain.size(); ++v) {
      samples.height[v] =
          static_cast<float>(height(0.3 * (v % 65 - 32) / 32, 0.3 * (v / 65 - 32) / 32));
      samples.spacing[v] = 0.01f;
      samples.measured[v] = 1;
    }
  }
  static constexpr int kInside = 32 * 65 + 32, kOnRim = 20;
  std::function<bool(int)> contradicted = [](int) { return false; };
  std::vector<int> Found() const {
    std::vector<int> vertices;
    const auto spikes = FindSpikes(finest, rings, samples, contradicted, Threads(2));
    for (const Spike& spike : *spikes) {
      vertices.push_back(spike.vertex);
    }
    return vertices;
  }
};

TEST_F(SheetHeights, ASingleSpikeIsFoundWithTheHeightToExpect) {
  Set([](double x, double y) { return 0.1 * x + 0.05 * y; });
  const int vertex = kInside;
  const float before = samples.height[vertex];
  samples.height[vertex] += 0.02f;
  const auto spikes = *FindSpikes(finest, rings, samples, contradicted, Threads(1));
  ASSERT_EQ(spikes.size(), 1u);
  EXPECT_EQ(spikes[0].vertex, vertex);
  EXPECT_NEAR(spikes[0].expected, before, 1e-6);
}

// All the points around an edge or corner agreed on its height: it has three times the room.
TEST_F(SheetHeights, WhatACreaseToldMayStandOutFarther) {
  Set([](double, double) { return 0.0; });
  const int vertex = kInside;
  samples.crease[vertex] = 1;
  samples.height[vertex] = 0.007f;
  EXPECT_THAT(Found(), ::testing::IsEmpty());
  samples.height[vertex] = 0.008f;
  EXPECT_THAT(Found(), ::testing::ElementsAre(vertex));
}

// What its fit does not know is no excuse.
TEST_F(SheetHeights, OnlyTheDeviationAroundWidensTheTolerance) {
  Set([](double, double) { return 0.0; });
  const int vertex = kInside;
  samples.height[vertex] = 0.02f;
  samples.deviation[vertex] = 0.02f;
  EXPECT_THAT(Found(), ::testing::ElementsAre(vertex));
  samples.deviation.assign(domain.size(), 0.0051f);
  EXPECT_THAT(Found(), ::testing::IsEmpty());
}

TEST_F(SheetHeights, WhatThePointsDenyHasNoExcuseButStandingOutLittle) {
  Set([](double, double) { return 0.0; });
  samples.deviation.assign(domain.size(), 0.0041f);
  const int vertex = kInside;
  samples.height[vertex] = 0.006f;
  EXPECT_THAT(Found(), ::testing::IsEmpty());
  contradicted = [&](int v) { return v == vertex; };
  EXPECT_THAT(Found(), ::testing::ElementsAre(vertex));
  samples.crease[vertex] = 1;
  EXPECT_THAT(Found(), ::testing::ElementsAre(vertex));
  samples.height[vertex] = 0.002f;
  EXPECT_THAT(Found(), ::testing::IsEmpty());
}

TEST_F(SheetHeights, SlopesStepsAndCrestsAreNone) {
  for (const auto& height : std::vector<std::function<double(double, double)>>{
           [](double x, double) { return 3 * x; },
           [](double x, double) { return x > 0.01 ? 0.04 : 0.0; },
           [](double x, double) { return -2 * std::abs(x); },
           [](double, double y) { return std::abs(y); }}) {
    Set(height);
    EXPECT_THAT(Found(), ::testing::IsEmpty());
  }
}

TEST_F(SheetHeights, ASpikeOnTheRimIsFound) {
  Set([](double x, double y) { return 0.5 * x + 2 * y; });
  samples.height[kOnRim] += 0.02f;
  EXPECT_THAT(Found(), ::testing::ElementsAre(kOnRim));
}

TEST_F(SheetHeights, NoiseIsNone) {
  Set([](double, double) { return 0.0; });
  Random random(1);
  for (int v = 0; v < domain.size(); ++v) {
    samples.height[v] = static_cast<float>(0.006 * Gauss(&random));
    samples.deviation[v] = 0.006f;
  }
  EXPECT_THAT(Found(), ::testing::IsEmpty());
}

TEST_F(SheetHeights, WhatIsNotMeasuredIsNotJudged) {
  Set([](double, double) { return 0.0; });
  const int vertex = kInside;
  samples.height[vertex] = 0.04f;
  samples.measured[vertex] = 0;
  EXPECT_THAT(Found(), ::testing::IsEmpty());
}

}  // namespace
}  // namespace rilievo
