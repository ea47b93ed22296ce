#include "core/displacement/window_ladder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace rilievo {
namespace {

// Nested means of 2, 8 and 32 draws of noise 0.1 about `bias[rung]`.
WindowLadder MeansOfNoise(const std::array<double, 3>& bias, std::mt19937* random) {
  std::normal_distribution<double> noise(0, 0.1);
  WindowLadder ladder;
  ladder.noise = 0.1f;
  double sum = 0;
  int drawn = 0;
  for (int rung = 0; rung < 3; ++rung) {
    const int count = 2 << (2 * rung);
    for (; drawn < count; ++drawn) sum += noise(*random);
    ladder.Add(rung, {static_cast<float>(sum / count + bias[rung]), 0, 0,
                      1.0f / static_cast<float>(count)});
  }
  return ladder;
}

std::vector<WindowLadder> Region(const std::array<double, 3>& bias) {
  std::mt19937 random(7);
  std::vector<WindowLadder> region;
  for (int i = 0; i < 512; ++i) region.push_back(MeansOfNoise(bias, &random));
  return region;
}

double Rms(const std::vector<WindowLadder>& region, const LadderTrust& trust) {
  double squares = 0;
  for (const WindowLadder& ladder : region) squares += std::pow(Climb(ladder, trust)->height, 2);
  return std::sqrt(squares / static_cast<double>(region.size()));
}

TEST(WindowLadderTest, AnEmptyLadderSaysNothing) {
  EXPECT_FALSE(Climb(WindowLadder(), LadderTrust()).has_value());
}

TEST(WindowLadderTest, NoiseAloneIsFollowedToTheWidestWindow) {
  const auto region = Region({0, 0, 0});
  const LadderTrust trust(region);
  for (int rung = 0; rung < 3; ++rung) EXPECT_EQ(trust.of(rung), 1) << rung;
  EXPECT_LT(Rms(region, trust), 0.1 / std::sqrt(32) * 1.6);
}

// Detail that only the widest window spans: an offset within the noise of one ray, but the same
// (up to its sign) at all of them.
TEST(WindowLadderTest, DetailOfTheRegionEndsTheClimbWhereOneRayCannotTell) {
  const auto region = Region({0, 0, 0.08});
  const LadderTrust trust(region);
  EXPECT_EQ(trust.of(1), 1);
  EXPECT_LT(trust.of(2), 0.2);
  EXPECT_LT(Rms(region, trust), 0.8 * Rms(region, LadderTrust()));
}

TEST(WindowLadderTest, FewRaysSayNothingOfTheRegion) {
  const auto region = Region({0, 0.5, 0.5});
  EXPECT_EQ(LadderTrust(std::span(region).first(20)).of(1), 1);
  EXPECT_EQ(LadderTrust(std::span<const WindowLadder>()).of(1), 1);
}

TEST(WindowLadderTest, AWindowFarOffIsNotFollowed) {
  WindowLadder ladder;
  ladder.noise = 0.1f;
  ladder.Add(0, {0.02f, 0, 0, 0.5f});
  ladder.Add(2, {1.0f, 0.3f, 0, 0.1f});
  EXPECT_TRUE(IsOut(ladder.windows[1], ladder.windows[0], ladder.noise));
  const auto fit = Climb(ladder, LadderTrust());
  ASSERT_TRUE(fit.has_value());
  EXPECT_EQ(fit->height, 0.02f);
  EXPECT_EQ(fit->variance_factor, 0.5f);
}

}  // namespace
}  // namespace rilievo
