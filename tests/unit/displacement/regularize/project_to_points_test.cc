#include "core/displacement/regularize/project_to_points.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;
using Eigen::Vector3d;

constexpr double kHalf = 0.3;
constexpr double kLeastNoise = 0.05;
constexpr int kVertices = 400;

// A sheet of noisy points, or with `folded` the two sides of a sharp convex edge along y.
struct NoisyScan {
  NoisyScan(bool folded, double noises) {
    Random random(7);
    const Points points =
        HeightFieldPoints(kHalf, 3600, &random, [](double, double) { return 0.0; });
    scan = MakeScan(points.Positions(), points.Normals(), 0);
    spacing = scan.cloud.median_spacing;
    for (int i = 0; i < scan.cloud.points.cols(); ++i) {
      auto point = scan.cloud.points.col(i);
      const double up = noises * spacing * Gauss(&random);
      if (folded && point.x() > 0) {
        point = Vector3d(up, point.y(), -point.x());
      } else {
        point.z() += up;
      }
      scan.cloud.noise[i] = static_cast<float>(noises * spacing);
    }
    scan.index = PointIndex(scan.cloud.points);
  }
  Scan scan = {{}, PointIndex(Eigen::Matrix3Xd::Zero(3, 1)), {}};
  double spacing = 0;
};

// The RMS over random places at x = `x` of heights that began `up` spacings above z = 0, in
// spacings.
double RmsAfterwards(const NoisyScan& noisy, const Vector3d& direction, double up, bool measured,
                     bool fitted, double x = 0) {
  Random random(3);
  LimitSurface limit;
  limit.positions.resize(3, kVertices);
  limit.normals = direction.normalized().replicate(1, kVertices);
  HeightSamples samples(kVertices);
  for (int v = 0; v < kVertices; ++v) {
    limit.positions.col(v) = Vector3d(x, Uniform(&random, -0.25, 0.25), 0);
    samples.height[v] = static_cast<float>(up * noisy.spacing);
    samples.measured[v] = measured;
    samples.fitted[v] = fitted;
  }
  EXPECT_TRUE(ProjectToPoints(noisy.scan.cloud, noisy.scan.index, limit, kLeastNoise, RunContext(),
                              &samples)
                  .ok());
  double sum = 0;
  for (const float height : samples.height) sum += height * height;
  return std::sqrt(sum / kVertices) / noisy.spacing;
}

TEST(KeepAmidTest, HeightsFarFromThePointsComeBack) {
  const NoisyScan sheet(false, 0.5);
  for (const double up : {-2.5, 2.5}) {
    EXPECT_LT(RmsAfterwards(sheet, Vector3d::UnitZ(), up, true, true), 0.6);
    EXPECT_LT(RmsAfterwards(sheet, Vector3d::UnitZ(), up, false, false), 0.6);
  }
}

TEST(KeepAmidTest, PiercedTrianglesAndThinNoiseAreLeftAlone) {
  EXPECT_NEAR(RmsAfterwards(NoisyScan(false, 0.5), Vector3d::UnitZ(), 2, true, false), 2, 1e-5);
  EXPECT_NEAR(RmsAfterwards(NoisyScan(false, 0.04), Vector3d::UnitZ(), 2, true, true), 2, 1e-5);
}

TEST(KeepAmidTest, FillsThatRanAstrayComeBackUnderAnyNoise) {
  const NoisyScan clean(false, 0);
  for (const double up : {-3.0, 3.0}) {
    EXPECT_LT(RmsAfterwards(clean, Vector3d::UnitZ(), up, false, false), 1e-6);
    EXPECT_NEAR(RmsAfterwards(clean, Vector3d::UnitZ(), up, true, false), 3, 1e-5) << "measured";
  }
  EXPECT_NEAR(RmsAfterwards(clean, Vector3d::UnitZ(), 0.5, false, false), 0.5, 1e-5) << "near";
}

TEST(KeepAmidTest, FillsOfAHoleStay) {
  const NoisyScan sheet(false, 0.5);
  const double beyond = kHalf + 3 * sheet.spacing;
  EXPECT_NEAR(RmsAfterwards(sheet, Vector3d::UnitZ(), 2.5, false, false, beyond), 2.5, 1e-5);
  EXPECT_NEAR(RmsAfterwards(NoisyScan(false, 0), Vector3d::UnitZ(), 2.5, false, false, beyond), 2.5,
              1e-5);
}

TEST(KeepAmidTest, SheetsAndSharpEdgesStayWhereTheyAre) {
  EXPECT_LT(RmsAfterwards(NoisyScan(false, 0.5), Vector3d::UnitZ(), 0, true, true), 0.02);
  EXPECT_LT(RmsAfterwards(NoisyScan(true, 0.1), Vector3d(1, 0, 1), 0, true, true), 0.1);
  EXPECT_LT(RmsAfterwards(NoisyScan(true, 0.5), Vector3d(1, 0, 1), 0, true, true), 0.1);
}

// Three faces of a box with thin noise, the points of each at random: the corner is off the mean of
// the points nearest to it by what chance left free there.
TEST(KeepAmidTest, HeightsThatTheSidesToldStayAtCorners) {
  constexpr int kScans = 40;
  int stayed = 0, stayed_untold = 0;
  for (int seed = 0; seed < kScans; ++seed) {
    Random random(seed);
    Points points;
    for (int i = 0; i < 1200; ++i) {
      Vector3d at(Uniform(&random, -1, 0), Uniform(&random, -1, 0), Uniform(&random, -1, 0));
      at[i % 3] = 0;
      points.Add(at, Vector3d::Unit(i % 3));
    }
    Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
    for (size_t i = 0; i < scan.cloud.noise.size(); ++i) {
      scan.cloud.noise[i] = 0.1f * scan.cloud.spacing[i];
    }
    LimitSurface limit;
    limit.positions = Eigen::Matrix3Xd::Zero(3, 2);
    limit.normals = Vector3d::Ones().normalized().replicate(1, 2);
    HeightSamples samples(2);
    samples.measured = samples.fitted = {1, 1};
    samples.crease = {1, 0};
    ASSERT_TRUE(
        ProjectToPoints(scan.cloud, scan.index, limit, kLeastNoise, RunContext(), &samples).ok());
    stayed += samples.height[0] == 0;
    stayed_untold += samples.height[1] == 0;
  }
  EXPECT_GE(stayed, kScans * 9 / 10);
  EXPECT_LT(stayed_untold, kScans / 2) << "planes taken on past an edge come back";
}

TEST(KeepAmidTest, StopsWhenAsked) {
  const NoisyScan sheet(false, 0.5);
  LimitSurface limit;
  limit.positions = Eigen::Matrix3Xd::Zero(3, 1);
  limit.normals = Vector3d::UnitZ();
  HeightSamples samples(1);
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  EXPECT_FALSE(
      ProjectToPoints(sheet.scan.cloud, sheet.scan.index, limit, kLeastNoise, context, &samples)
          .ok());
}

}  // namespace
}  // namespace rilievo
