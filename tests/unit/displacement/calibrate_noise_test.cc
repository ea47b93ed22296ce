#include "core/displacement/calibrate_noise.h"

#include <gtest/gtest.h>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

// A noisy sphere whose noise is stated as `stated` times the truth.
float Calibrate(double noise, double stated, int threads = 2) {
  Random random(1);
  Points points = SpherePoints(0.3, 20000);
  for (size_t i = 0; i < points.at.size(); ++i)
    points.at[i] += noise * Gauss(&random) * points.normal[i];
  const Scan scan = MakeScan(points.Positions(), points.Normals(), stated * noise);
  const RayCloud cloud = *PrepareRayCloud(scan.cloud, scan.graph, Threads(threads));
  return *NoiseCalibration(cloud, scan.graph, 0.15f, Threads(threads));
}

TEST(NoiseCalibrationTest, FindsTheFactorByWhichNoiseWasMisstated) {
  EXPECT_NEAR(Calibrate(0.003, 1.0), 1.0, 0.08);
  EXPECT_NEAR(Calibrate(0.003, 0.7), 1 / 0.7, 0.12);
  EXPECT_NEAR(Calibrate(0.003, 1.3), 1 / 1.3, 0.08);
}

TEST(NoiseCalibrationTest, CleanScansStayAsTheyAre) {
  EXPECT_EQ(Calibrate(1e-5, 1.0), 1.0f);
  EXPECT_EQ(Calibrate(0, 1.0), 1.0f);
}

TEST(NoiseCalibrationTest, DoesNotDependOnTheThreads) {
  EXPECT_EQ(Calibrate(0.003, 0.7, 1), Calibrate(0.003, 0.7, 3));
}

}  // namespace
}  // namespace rilievo
