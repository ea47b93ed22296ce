#include "core/displacement/regularize/input_laplacian.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

struct LaplacianTest : ::testing::Test {
  Domain domain = MakeDomain(Sheet(0.3, 8), 3);
  const MeshTopology& finest = domain.refinement.levels.back();
  VertexRings rings = BuildVertexRings(finest);
  HeightSamples samples{static_cast<size_t>(domain.size())};

  LaplacianTest() { samples.measured.assign(domain.size(), 1); }
  void Smooth(int rounds, int threads = 2) {
    ASSERT_TRUE(SmoothHeights(finest, rings, rounds, Threads(threads), &samples).ok());
  }
  double Rms(bool rim) const {
    double sum = 0;
    int count = 0;
    for (int v = 0; v < domain.size(); ++v) {
      if ((finest.boundary_vertex[v] != 0) != rim) continue;
      sum += samples.height[v] * samples.height[v];
      ++count;
    }
    return std::sqrt(sum / count);
  }
  void AddNoise(double noise) {
    Random random(1);
    for (float& height : samples.height) height += static_cast<float>(noise * Gauss(&random));
    samples.deviation.assign(domain.size(), static_cast<float>(noise));
  }
};

TEST_F(LaplacianTest, WithoutNoiseNothingMoves) {
  Random random(2);
  for (float& height : samples.height) height = static_cast<float>(Uniform(&random, -1, 1));
  const std::vector<float> before = samples.height;
  Smooth(5);
  EXPECT_EQ(samples.height, before);
}

// What one round leaves of unit noise h with m neighbours: with d = mean - h of variance 1 + 1/m,
// h given d is -d / (1 + 1/m) on average, and the new height h + d / (1 + d^2) / 2.
double NoiseLeft(int valence) {
  const double variance = 1 + 1.0 / valence;
  double first = 0, second = 0;  // means of d^2 / (1 + d^2) and of d^2 / (1 + d^2)^2
  constexpr double kStep = 0.01;
  for (double x = -8; x < 8; x += kStep) {
    const double density = kStep * std::exp(-x * x / 2) / std::sqrt(2 * M_PI);
    const double square = variance * x * x;
    first += density * square / (1 + square);
    second += density * square / ((1 + square) * (1 + square));
  }
  return std::sqrt(1 - first / variance + second / 4);
}

TEST_F(LaplacianTest, NoiseShrinksAsTheFormulaSays) {
  AddNoise(0.001);
  const double inside = Rms(false), rim = Rms(true);
  Smooth(1);
  EXPECT_NEAR(Rms(false) / inside, NoiseLeft(6), 0.01);
  EXPECT_NEAR(Rms(true) / rim, NoiseLeft(2), 0.03);  // 256 vertices
  Smooth(4);
  EXPECT_LT(Rms(false), 0.8 * inside);
}

TEST_F(LaplacianTest, AStepStandsOutOfTheNoiseAndStays) {
  AddNoise(0.0005);
  for (int v = 0; v < domain.size(); ++v) {
    if (domain.limit.positions(0, v) > 0) samples.height[v] += 0.05f;
  }
  const std::vector<float> before = samples.height;
  Smooth(3);
  for (int v = 0; v < domain.size(); ++v) {
    EXPECT_LT(std::abs(samples.height[v] - before[v]), 3 * 0.0005) << v;
  }
}

TEST_F(LaplacianTest, SlopesStayToTheRim) {
  // Even along the mesh; the limit's own positions are not, near the rim.
  const Domain even = MakeDomain(Sheet(0.3, 64), 0);
  const VertexRings even_rings = BuildVertexRings(even.refinement.levels[0]);
  samples = HeightSamples(static_cast<size_t>(even.size()));
  samples.measured.assign(even.size(), 1);
  samples.deviation.assign(even.size(), 0.01f);
  for (int v = 0; v < even.size(); ++v) {
    samples.height[v] = 0.01f * static_cast<float>(v % 65) - 0.02f * static_cast<float>(v / 65);
  }
  const std::vector<float> before = samples.height;
  ASSERT_TRUE(SmoothHeights(even.refinement.levels[0], even_rings, 1, RunContext(), &samples).ok());
  for (int v = 0; v < even.size(); ++v) {
    const bool corner = (v % 65) % 64 == 0 && (v / 65) % 64 == 0;
    if (corner) continue;
    EXPECT_NEAR(samples.height[v], before[v], 1e-6) << v;
  }
}

TEST_F(LaplacianTest, WhatIsNotMeasuredTakesNoPart) {
  AddNoise(0.001);
  samples.measured[100] = 0;
  samples.height[100] = 1e6f;
  Smooth(3);
  EXPECT_EQ(samples.height[100], 1e6f);
  samples.height[100] = 0;
  EXPECT_LT(Rms(false), 0.001);
}

TEST_F(LaplacianTest, SameForAnyNumberOfThreads) {
  AddNoise(0.001);
  const HeightSamples before = samples;
  Smooth(3, 1);
  const std::vector<float> one = samples.height;
  samples = before;
  Smooth(3, 4);
  EXPECT_EQ(samples.height, one);
}

}  // namespace
}  // namespace rilievo
