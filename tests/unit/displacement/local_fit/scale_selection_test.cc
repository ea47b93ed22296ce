#include "core/displacement/local_fit/scale_selection.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace rilievo {
namespace {

constexpr float kNoise = 0.1f;
constexpr int kRays = 512;

// Means of 4, 16 and 64 draws of noise about `bias[level]`, nested, at levels 1 to 3.
ScaleLadder MeansOfNoise(const std::array<double, 3>& bias, std::mt19937* random) {
  std::normal_distribution<double> noise(0, kNoise);
  ScaleLadder ladder;
  ladder.noise = kNoise;
  double sum = 0;
  int drawn = 0;
  for (int level = 0; level < 3; ++level) {
    const int count = 4 << (2 * level);
    for (; drawn < count; ++drawn) sum += noise(*random);
    ladder.Add(level + 1, {static_cast<float>(sum / count + bias[level]), 0, 0,
                           1.0f / static_cast<float>(count)});
  }
  return ladder;
}

std::vector<ScaleLadder> Ladders(const std::array<double, 3>& bias) {
  std::mt19937 random(7);
  std::vector<ScaleLadder> ladders;
  for (int i = 0; i < kRays; ++i) ladders.push_back(MeansOfNoise(bias, &random));
  return ladders;
}

// Rays `first` to `last` in groups of eight about one place.
std::vector<RayGroup> Groups(int first, int last, const Eigen::Vector3f& position) {
  std::vector<RayGroup> groups;
  for (int ray = first; ray < last; ++ray) {
    if ((ray - first) % 8 == 0) groups.push_back({position, Eigen::Vector3f::UnitZ(), 1, {}});
    groups.back().rays.push_back(ray);
  }
  return groups;
}

double Rms(const std::vector<std::optional<FitWindow>>& windows, int first, int last) {
  double squares = 0;
  for (int i = first; i < last; ++i) squares += std::pow(windows[i]->height, 2);
  return std::sqrt(squares / (last - first));
}

TEST(SelectScalesTogetherTest, NoiseAloneIsFollowedToTheWidestWindow) {
  const auto ladders = Ladders({0, 0, 0});
  const auto windows = SelectScalesTogether(ladders, Groups(0, kRays, Eigen::Vector3f::Zero()));
  EXPECT_LT(Rms(windows, 0, kRays), kNoise / std::sqrt(64) * 1.4);
  EXPECT_NEAR(windows[0]->variance_factor, 1.0 / 64, 0.4 / 64);
}

// An offset within the noise of one ray, but the same at all of them.
TEST(SelectScalesTogetherTest, DetailThatWideWindowsSpanEndsTheClimbWhereOneRayCannotTell) {
  const double bias = 0.05;
  const auto ladders = Ladders({0, 0, bias});
  const auto windows = SelectScalesTogether(ladders, Groups(0, kRays, Eigen::Vector3f::Zero()));
  EXPECT_LT(Rms(windows, 0, kRays), 1.25 * kNoise / std::sqrt(16));
  double alone = 0;
  for (const ScaleLadder& ladder : ladders) alone += std::pow(SelectScale(ladder)->height, 2);
  EXPECT_LT(Rms(windows, 0, kRays), 0.8 * std::sqrt(alone / kRays));
}

TEST(SelectScalesTogetherTest, DetailElsewhereOrOfTheOtherSideIsNoEvidence) {
  std::vector<ScaleLadder> ladders = Ladders({0, 0, 0});
  const auto rough = Ladders({0, 0.5, 0.5});
  std::copy(rough.begin() + kRays / 2, rough.end(), ladders.begin() + kRays / 2);
  for (const bool turned : {false, true}) {
    auto groups = Groups(0, kRays / 2, Eigen::Vector3f::Zero());
    const Eigen::Vector3f place = turned ? Eigen::Vector3f::Zero() : Eigen::Vector3f(100, 0, 0);
    for (RayGroup& group : Groups(kRays / 2, kRays, place)) {
      if (turned) group.direction = -group.direction;
      groups.push_back(group);
    }
    const auto windows = SelectScalesTogether(ladders, groups);
    EXPECT_LT(Rms(windows, 0, kRays / 2), kNoise / std::sqrt(64) * 1.4) << turned;
    EXPECT_LT(Rms(windows, kRays / 2, kRays), kNoise / std::sqrt(4) * 1.1) << turned;
  }
}

TEST(SelectScalesTogetherTest, EmptyLaddersSayNothingAndRungsMayBeMissing) {
  std::vector<ScaleLadder> ladders(3);
  for (ScaleLadder& ladder : ladders) ladder.noise = kNoise;
  ladders[1].Add(2, {0.02f, 0, 0, 0.5f});
  ladders[2].Add(0, {0.02f, 0, 0, 0.5f});
  ladders[2].Add(5, {0.02f, 0, 0, 0.1f});
  const auto windows = SelectScalesTogether(ladders, Groups(0, 3, Eigen::Vector3f::Zero()));
  EXPECT_FALSE(windows[0].has_value());
  EXPECT_EQ(windows[1]->variance_factor, 0.5f);
  EXPECT_EQ(windows[2]->variance_factor, 0.1f);
  EXPECT_TRUE(SelectScalesTogether({}, {}).empty());
}

}  // namespace
}  // namespace rilievo
