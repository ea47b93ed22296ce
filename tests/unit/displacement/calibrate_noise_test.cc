#include "core/displacement/calibrate_noise.h"

#include <gtest/gtest.h>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

// A noisy sphere, of a spacing of some 0.008, with waves of that length (none: 0) and of a height
// of a tenth of it, whose noise is stated as `stated` times the truth.
float Calibrate(double noise, double stated, int threads = 2, double wave = 0) {
  Random random(1);
  Points points = SpherePoints(0.3, 20000);
  for (size_t i = 0; i < points.at.size(); ++i) {
    const Eigen::Vector3d at = points.at[i] * (wave > 0 ? 2 * M_PI / wave : 0);
    points.at[i] += (noise * Gauss(&random) +
                     0.1 * wave * std::sin(at.x()) * std::sin(at.y()) * std::sin(at.z())) *
                    points.normal[i];
  }
  const Scan scan = MakeScan(points.Positions(), points.Normals(), stated * noise);
  const RayCloud cloud = *PrepareRayCloud(scan.cloud, scan.graph, Threads(threads));
  return *NoiseCalibration(cloud, scan.graph, 0.05f, Threads(threads));
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

TEST(NoiseCalibrationTest, DetailIsNotNoise) {
  for (const double wave : {0.06, 0.07, 0.08}) {
    SCOPED_TRACE(wave);
    EXPECT_NEAR(Calibrate(0.001, 1.0, 2, wave), 1.0, 0.25);
  }
}

TEST(NoiseCalibrationTest, DoesNotDependOnTheThreads) {
  EXPECT_EQ(Calibrate(0.003, 0.7, 1), Calibrate(0.003, 0.7, 3));
}

}  // namespace
}  // namespace rilievo
