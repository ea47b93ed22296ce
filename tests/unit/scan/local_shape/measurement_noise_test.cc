#include "core/scan/local_shape/measurement_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>
#include <vector>

#include "core/scan/local_shape/settings.h"
#include "tests/scans/random.h"

namespace rilievo {
namespace {

// Points along the diagonal of the unit cube, in the order of its curve.
Eigen::Matrix3Xd Diagonal(int count) {
  Eigen::Matrix3Xd points(3, count);
  for (int i = 0; i < count; ++i) points.col(i).setConstant((i + 0.5) / count - 0.5);
  return points;
}

// Sizes of Gaussian residuals, of the deviation that they have in `noise_at`.
template <typename NoiseAt>
std::vector<float> GaussianResiduals(int count, const NoiseAt& noise_at) {
  Random random(3);
  std::vector<float> residuals;
  for (int i = 0; i < count; ++i) {
    double sum = 0;
    for (int k = 0; k < 11; ++k) sum += std::pow(random.Normal(), 2);
    residuals.push_back(static_cast<float>(noise_at(i) * std::sqrt(sum / 11)));
  }
  return residuals;
}

std::vector<float> DiagonalNoise(const std::vector<float>& residuals, int threads = 1) {
  RunContext context;
  context.threads = threads;
  const Eigen::Matrix3Xd points = Diagonal(static_cast<int>(residuals.size()));
  return MeasurementNoise(points, SpatialFrame(), residuals, context).value();
}

TEST(MeasurementNoiseTest, IsTheDeviationWhereItChanges) {
  constexpr int kCount = 32768;
  const std::vector<float> noise =
      DiagonalNoise(GaussianResiduals(kCount, [](int i) { return i < kCount / 2 ? 1.0 : 1.4; }));
  for (int i = 0; i < kCount; i += 100) EXPECT_NEAR(noise[i], i < kCount / 2 ? 1 : 1.4, 0.15);
}

// Residuals of a crease, a stretch long, are not taken for noise.
TEST(MeasurementNoiseTest, IsBoundedByThatAround) {
  const std::vector<float> noise = DiagonalNoise(
      GaussianResiduals(32768, [](int i) { return i >= 4096 && i < 4352 ? 20.0 : 1.0; }));
  const double most = kMeasurementNoise.stretches[1].bound * 1.15;
  for (const float at : noise) EXPECT_LT(at, most);
  EXPECT_GT(noise[4200], 1.3);
}

TEST(MeasurementNoiseTest, AnyNumberOfThreadsFindsTheSame) {
  const std::vector<float> residuals = GaussianResiduals(20000, [](int i) { return 1 + i % 7; });
  EXPECT_EQ(DiagonalNoise(residuals, 1), DiagonalNoise(residuals, 4));
}

TEST(MeasurementNoiseTest, NoPointsHaveNone) { EXPECT_TRUE(DiagonalNoise({}).empty()); }

TEST(MeasurementNoiseTest, StopsWhenCancelled) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  const std::vector<float> residuals(20000, 1.0f);
  EXPECT_EQ(MeasurementNoise(Diagonal(20000), SpatialFrame(), residuals, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
