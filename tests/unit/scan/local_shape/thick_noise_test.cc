#include "core/scan/local_shape/thick_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

#include "core/scan/scan_surface.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

struct NoisySphere {
  PreparedCloud prepared;
  OrientedCloud cloud;
  double noise;  // the truth, unit frame
};

// Its noise is stated as `stated` times the truth. `noise`: of a unit sphere.
NoisySphere MakeNoisySphere(int points, double noise, double stated) {
  KnownCloud sphere = SphereCloud(points, 3);
  AddNoise(noise, 4, &sphere);
  NoisySphere made{Prepare(sphere), {}, 0};
  made.noise = noise / made.prepared.scan.frame.diagonal;
  made.cloud.points = made.prepared.scan.points;
  made.cloud.normals = made.prepared.normals;
  const double spacing = 4 / std::sqrt(points) / made.prepared.scan.frame.diagonal;
  made.cloud.spacing.assign(made.cloud.points.cols(), static_cast<float>(spacing));
  made.cloud.noise.assign(made.cloud.spacing.size(), static_cast<float>(stated * made.noise));
  return made;
}

// The factor that the noise of the first point took.
double Scale(NoisySphere made, int threads = 2) {
  RunContext context;
  context.threads = threads;
  const float before = made.cloud.noise[0];
  EXPECT_TRUE(CorrectThickNoise(PointIndex(made.cloud.points), context, &made.cloud).ok());
  return made.cloud.noise[0] / before;
}

TEST(NoiseScaleTest, FindsWhatWasUnderstated) {
  for (const double noise : {0.018, 0.03}) {  // spacing 0.0163
    for (const double stated : {0.5, 0.7, 1.0}) {
      EXPECT_NEAR(Scale(MakeNoisySphere(60000, noise, stated)), 1 / stated, 0.12 / stated)
          << noise << " " << stated;
    }
  }
}

TEST(NoiseScaleTest, LeavesScansAloneThatAreNotNoisy) {
  EXPECT_EQ(Scale(MakeNoisySphere(20000, 0.001, 1)), 1);
  EXPECT_EQ(Scale(MakeNoisySphere(20000, 0.02, 2)), 1);  // overstated: nothing is taken back
}

// Foliage on a clean wall: what it says of its own noise is nothing to the wall.
TEST(NoiseScaleTest, NoisyPartsLeaveCleanOnesAlone) {
  NoisySphere made = MakeNoisySphere(60000, 0.03, 0.5);
  const size_t count = made.cloud.noise.size();
  for (size_t i = count / 2; i < count; ++i) made.cloud.noise[i] = 1e-3f * made.cloud.spacing[i];
  const OrientedCloud before = made.cloud;
  ASSERT_TRUE(CorrectThickNoise(PointIndex(made.cloud.points), RunContext{}, &made.cloud).ok());
  EXPECT_NEAR(made.cloud.noise[0] / before.noise[0], 2, 0.3);
  for (size_t i = count / 2; i < count; ++i) ASSERT_EQ(made.cloud.noise[i], before.noise[i]);
}

TEST(NoiseScaleTest, SameForAnyThreadCount) {
  const NoisySphere made = MakeNoisySphere(20000, 0.02, 0.6);
  EXPECT_EQ(Scale(made, 1), Scale(made, 3));
}

// What the whole analysis says of noise twice and five times as thick as the spacing: the sixteen
// nearest points alone say half, and a ball for the noise that they say shows too little of it.
TEST(NoiseScaleTest, TheAnalysisKnowsThickNoise) {
  for (const auto& [noise, within] : {std::pair(0.025, 0.003), std::pair(0.06, 0.007)}) {
    KnownCloud sphere = SphereCloud(100000, 5);
    AddNoise(noise, 6, &sphere);
    CheckedScan checked = CheckScan(sphere.cloud, CheckOptions{}, RunContext{}).value();
    const ScanSurface scan = AnalyzeScan(std::move(checked), ScanOptions{}, RunContext{}).value();
    EXPECT_NEAR(scan.cloud.median_noise * scan.frame.diagonal, noise, within);
  }
}

}  // namespace
}  // namespace rilievo
