#include "core/displacement/local_fit/calibrate_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

constexpr float kLeastRatio = 0.05f;

struct Ball {
  double noise = 0.003;
  double stated = 1;  // in its true noise
  // Waves on it of that length (none: 0), a tenth of it high; the spacing is some 0.008.
  double wave = 0;
  double noise_growth = 0;  // of noise and of what is stated of it, from one pole to the other
};

// The noises of the points of the ball over those stated.
std::vector<float> Calibrate(const Ball& ball, int threads = 2) {
  Random random(1);
  Points points = SpherePoints(0.3, 20000);
  std::vector<float> growth;
  for (size_t i = 0; i < points.at.size(); ++i) {
    growth.push_back(static_cast<float>(1 + ball.noise_growth * (0.5 + points.at[i].z() / 0.6)));
    const Eigen::Vector3d at = points.at[i] * (ball.wave > 0 ? 2 * M_PI / ball.wave : 0);
    const double wave = 0.1 * ball.wave * std::sin(at.x()) * std::sin(at.y()) * std::sin(at.z());
    points.at[i] += (growth[i] * ball.noise * Gauss(&random) + wave) * points.normal[i];
  }
  Scan scan = MakeScan(points.Positions(), points.Normals(), ball.stated * ball.noise);
  for (size_t i = 0; i < growth.size(); ++i) scan.cloud.noise[i] *= growth[i];
  RayCloud cloud = *PrepareRayCloud(scan.cloud, scan.graph, Threads(threads));
  const std::vector<RayPoint> before = cloud.points;
  EXPECT_TRUE(CalibrateNoise(scan.graph, kLeastRatio, Threads(threads), &cloud).ok());
  std::vector<float> ratios;
  for (size_t i = 0; i < before.size(); ++i) {
    ratios.push_back(
        before[i].noise == cloud.points[i].noise ? 1 : cloud.points[i].noise / before[i].noise);
  }
  return ratios;
}

// That of the middle point, after checking that all have it.
float OneRatio(const Ball& ball) {
  const std::vector<float> ratios = Calibrate(ball);
  const auto [least, most] = std::minmax_element(ratios.begin(), ratios.end());
  EXPECT_NEAR(*least, *most, 1e-4);
  return ratios[ratios.size() / 2];
}

TEST(CalibrateNoiseTest, FindsTheFactorByWhichNoiseWasMisstated) {
  EXPECT_NEAR(OneRatio({.stated = 1.0}), 1.0, 0.08);
  EXPECT_NEAR(OneRatio({.stated = 0.7}), 1 / 0.7, 0.12);
  EXPECT_NEAR(OneRatio({.stated = 1.3}), 1 / 1.3, 0.08);
}

TEST(CalibrateNoiseTest, CleanScansStayAsTheyAre) {
  EXPECT_EQ(OneRatio({.noise = 1e-5}), 1.0f);
  EXPECT_EQ(OneRatio({.noise = 0}), 1.0f);
}

TEST(CalibrateNoiseTest, DetailIsNotNoise) {
  for (const double wave : {0.06, 0.07, 0.08}) {
    SCOPED_TRACE(wave);
    EXPECT_NEAR(OneRatio({.noise = 0.001, .wave = wave}), 1.0, 0.25);
  }
}

// One that is overstated at every second point.
TEST(CalibrateNoiseTest, ThickNoiseThatIsTheSameEverywhereIsStatedSo) {
  const auto spread = [](float noise) {
    Random random(1);
    Points points = SpherePoints(0.3, 20000);
    for (size_t i = 0; i < points.at.size(); ++i) {
      points.at[i] += noise * Gauss(&random) * points.normal[i];
    }
    const Scan scan = MakeScan(points.Positions(), points.Normals(), noise);
    RayCloud cloud = *PrepareRayCloud(scan.cloud, scan.graph, Threads(2));
    for (size_t i = 0; i < cloud.points.size(); i += 2) cloud.points[i].noise *= 1.3f;
    EXPECT_TRUE(CalibrateNoise(scan.graph, kLeastRatio, Threads(2), &cloud).ok());
    EXPECT_NEAR(cloud.points[1].noise, noise, 0.15f * noise);
    return cloud.points[0].noise / cloud.points[1].noise;
  };
  EXPECT_NEAR(spread(0.003f), 1.0f, 0.01f);
  EXPECT_NEAR(spread(0.001f), 1.3f, 0.01f) << "thin noise is told by the points around";
}

TEST(CalibrateNoiseTest, TwoNoisesStayTwo) {
  Random random(1);
  Points points = SpherePoints(0.3, 20000);
  const auto noise_at = [](const Eigen::Vector3d& at) { return at.z() > 0.12 ? 0.006f : 0.002f; };
  std::vector<float> noise;
  for (size_t i = 0; i < points.at.size(); ++i) {
    noise.push_back(noise_at(points.at[i]));
    points.at[i] += noise[i] * Gauss(&random) * points.normal[i];
  }
  Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  scan.cloud.noise = noise;
  RayCloud cloud = *PrepareRayCloud(scan.cloud, scan.graph, Threads(2));
  ASSERT_TRUE(CalibrateNoise(scan.graph, kLeastRatio, Threads(2), &cloud).ok());
  for (size_t i = 0; i < noise.size(); ++i) {
    if (std::abs(points.normal[i].z() - 0.4) < 0.1) continue;  // between the two
    ASSERT_NEAR(cloud.points[i].noise, noise[i], 0.25f * noise[i]) << i;
  }
}

TEST(CalibrateNoiseTest, NoiseThatDiffersFromPlaceToPlaceStaysSo) {
  for (const float ratio : Calibrate({.noise_growth = 2})) ASSERT_NEAR(ratio, 1, 0.1);
}

TEST(CalibrateNoiseTest, DoesNotDependOnTheThreads) {
  EXPECT_EQ(Calibrate({.stated = 0.7}, 1), Calibrate({.stated = 0.7}, 3));
}

}  // namespace
}  // namespace rilievo
