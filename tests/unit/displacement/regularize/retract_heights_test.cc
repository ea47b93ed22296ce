#include "core/displacement/regularize/retract_heights.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stop_token>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;
using Eigen::Vector3d;

constexpr double kHalf = 0.3;
constexpr int kVertices = 200;

// A sheet z = 0, all around or for x < 0 alone.
Scan SheetScan(bool half, double noises = 0) {
  Random random(7);
  const Points sheet = HeightFieldPoints(kHalf, 3600, &random, [](double, double) { return 0.0; });
  Points points;
  for (const Vector3d& at : sheet.at) {
    if (!half || at.x() < 0) points.Add(at, Vector3d::UnitZ());
  }
  Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  for (float& noise : scan.cloud.noise) {
    noise = static_cast<float>(noises * scan.cloud.median_spacing);
  }
  return scan;
}

// Vertices over x = `x`, all heights `up` spacings.
struct Heights {
  Heights(const Scan& scan, double up, const Vector3d& direction = Vector3d::UnitZ(), double x = 0,
          double z = 0)
      : spacing(scan.cloud.median_spacing), samples(kVertices) {
    Random random(3);
    limit.positions.resize(3, kVertices);
    limit.normals = direction.normalized().replicate(1, kVertices);
    for (int v = 0; v < kVertices; ++v) {
      limit.positions.col(v) = Vector3d(x * spacing, Uniform(&random, -0.25, 0.25), z * spacing);
      samples.height[v] = static_cast<float>(up * spacing);
    }
  }
  absl::Status Run(const Scan& scan, const RunContext& context = Threads(2)) {
    return RetractHeights(scan.cloud, scan.index, limit, context, &samples);
  }
  // In spacings.
  double Largest() const {
    float largest = 0;
    for (const float height : samples.height) largest = std::max(largest, std::abs(height));
    return largest / spacing;
  }
  double spacing;
  LimitSurface limit;
  HeightSamples samples;
};

double LargestAfterwards(const Scan& scan, Heights heights) {
  EXPECT_TRUE(heights.Run(scan).ok());
  return heights.Largest();
}

TEST(RetractHeightsTest, HeightsFarFromAllPointsComeBack) {
  const Scan scan = SheetScan(false);
  for (const double up : {-3.0, 3.0, 1.5}) {
    EXPECT_LT(LargestAfterwards(scan, {scan, up}), 0.01) << "a fill " << up;
    Heights measured(scan, up);
    std::fill(measured.samples.measured.begin(), measured.samples.measured.end(), 1);
    ASSERT_TRUE(measured.Run(scan).ok());
    EXPECT_LT(measured.Largest(), 0.01) << "measured " << up;
    for (int v = 0; v < kVertices; ++v) EXPECT_EQ(measured.samples.fitted[v], 1);
  }
}

TEST(RetractHeightsTest, HeightsBesidePointsStay) {
  const Scan scan = SheetScan(false);
  EXPECT_NEAR(LargestAfterwards(scan, {scan, 0.4}), 0.4, 1e-5);
  EXPECT_NEAR(LargestAfterwards(SheetScan(false, 3), {scan, 2}), 2, 1e-5) << "within the noise";
}

TEST(RetractHeightsTest, WhereTheDomainIsNoNearerTheyStay) {
  const Scan whole = SheetScan(false), half = SheetScan(true);
  EXPECT_NEAR(LargestAfterwards(whole, {whole, 8, Vector3d::UnitZ(), 0, -4}), 4, 1e-5)
      << "only as far as the sheet, on the way to a domain below it";
  EXPECT_NEAR(LargestAfterwards(half, {half, 2, Vector3d::UnitZ(), 6}), 2, 1e-5) << "over a hole";
  EXPECT_NEAR(LargestAfterwards(whole, {whole, 3, -Vector3d::UnitZ(), 0, 0}), 3, 1e-5)
      << "the sheet is the other side of a wall";
}

TEST(RetractHeightsTest, StopsWhenAsked) {
  const Scan scan = SheetScan(false);
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  EXPECT_EQ(Heights(scan, 2).Run(scan, context).code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
