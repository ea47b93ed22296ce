#include "core/scan/scan_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

ScanSurface AnalyzeWithOutliers() {
  ScannerOptions options;
  options.points = 10000;
  options.outliers = 0.02;
  options.views = 0;
  const SimulatedScan scan = SimulateScan(*MakeTorus(), options).value();
  const CheckedScan checked = CheckScan(scan.cloud, CheckOptions{}, RunContext{}).value();
  return AnalyzeScan(checked, ScanOptions{}, RunContext{}).value();
}

TEST(ScanSurfaceTest, CloudGraphAndIndexSpeakOfTheSamePoints) {
  const ScanSurface scan = AnalyzeWithOutliers();
  const int count = static_cast<int>(scan.cloud.points.cols());
  EXPECT_GT(scan.figures.outliers, 100);
  ASSERT_EQ(scan.graph.size(), count);
  ASSERT_EQ(scan.index.size(), count);
  ASSERT_EQ(scan.cloud.normals.cols(), count);
  for (int i = 0; i < count; i += 37) {
    int nearest[17];
    double squared[17];
    ASSERT_EQ(scan.index.Nearest(scan.cloud.points.col(i), scan.graph.k + 1, nearest, squared),
              scan.graph.k + 1);
    EXPECT_EQ(nearest[0], i);
    const std::vector<float> distances = NeighborDistances(scan.cloud.points, scan.graph, i);
    for (int k = 0; k < scan.graph.k; ++k) {
      EXPECT_NEAR(distances[k], std::sqrt(squared[k + 1]), 1e-6);
    }
  }
}

// The frame is rounded in any case, and the index must follow.
TEST(ScanSurfaceTest, TheIndexHoldsThePointsWhereNothingIsDropped) {
  ScannerOptions options;
  options.points = 5000;
  options.views = 0;
  SimulatedScan scan = SimulateScan(*MakeTorus(), options).value();
  scan.cloud.points.colwise() += Eigen::Vector3d(0.123, 4.567, -8.901);
  const CheckedScan checked = CheckScan(scan.cloud, CheckOptions{}, RunContext{}).value();
  ScanOptions analysis;
  analysis.outliers.distance_factor = 0;
  const ScanSurface surface = AnalyzeScan(checked, analysis, RunContext{}).value();
  ASSERT_EQ(surface.cloud.points.cols(), checked.points.cols());
  for (int i = 0; i < surface.index.size(); i += 37) {
    int nearest = -1;
    double squared = 1;
    surface.index.Nearest(surface.cloud.points.col(i), 1, &nearest, &squared);
    EXPECT_EQ(nearest, i);
    EXPECT_EQ(squared, 0);
  }
}

// Fewer points than neighbours were asked for are left: the lists are built anew, and shorter.
TEST(ScanSurfaceTest, OutliersLeaveFewerPointsThanNeighbours) {
  CheckedScan checked;
  checked.points.resize(3, 70);
  checked.source_index.resize(70);
  for (int i = 0; i < 64; ++i) checked.points.col(i) << 0.01 * (i % 8), 0.01 * (i / 8), 0;
  for (int i = 64; i < 70; ++i) checked.points.col(i) << 0.4 + 0.1 * i, 0.3, 0.1 * i;
  ScanOptions options;
  options.neighbors.k = 64;
  options.outliers.distance_factor = 1.5;
  const auto scan = AnalyzeScan(checked, options, RunContext{});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_GT(scan->figures.outliers, 0);
  EXPECT_LE(scan->cloud.points.cols(), 64);
  EXPECT_EQ(scan->graph.k, scan->cloud.points.cols() - 1);
  EXPECT_EQ(scan->graph.size(), scan->cloud.points.cols());
}

TEST(ScanSurfaceTest, TheFrameIsTheBoxOfWhatWasKept) {
  const ScanSurface scan = AnalyzeWithOutliers();
  const Eigen::Vector3d low = scan.cloud.points.rowwise().minCoeff();
  const Eigen::Vector3d high = scan.cloud.points.rowwise().maxCoeff();
  // The frame is rounded: to 20 binary digits, and to a grid of 2^-10 to 2^-11 of the diagonal.
  EXPECT_NEAR((high - low).norm(), 1, 0x1p-20);
  EXPECT_LE((high + low).cwiseAbs().maxCoeff() / 2, 0x1p-11);
}

TEST(ScanSurfaceTest, SpacingCoversTheArea) {
  const ScanSurface scan = AnalyzeWithOutliers();
  double area = 0;
  for (const float spacing : scan.cloud.spacing) area += M_PI / 4 * spacing * spacing;
  const double truth = 4 * M_PI * M_PI * 0.7 * 0.28 / (scan.frame.diagonal * scan.frame.diagonal);
  EXPECT_NEAR(area / truth, 1, 0.25);
}

// Beside the edges of a noisy box: most normals there are those of one side, not the blend of two.
TEST(ScanSurfaceTest, NormalsBesideNoisyEdgesAreThoseOfTheirSides) {
  KnownCloud known = BoxCloud(30000, 9, {1, 1, 1});
  AddNoise(0.004, 21, &known);
  const CheckedScan checked = CheckScan(known.cloud, CheckOptions{}, RunContext{}).value();
  const ScanSurface scan = AnalyzeScan(checked, ScanOptions{}, RunContext{}).value();
  const auto upright = scan.cloud.normals.array().abs().colwise().maxCoeff();
  EXPECT_LT((upright < std::cos(20 * std::numbers::pi / 180)).cast<double>().mean(), 0.02);
}

// Enough points for packed lists and an index over the cloud's own points.
TEST(ScanSurfaceTest, ManyPointsAreTheSameForOneThreadAndFour) {
  ScannerOptions options;
  options.points = 210000;
  options.views = 0;
  const SimulatedScan simulated = SimulateScan(*MakeTorus(), options).value();
  const CheckedScan checked = CheckScan(simulated.cloud, CheckOptions{}, RunContext{}).value();
  RunContext one, four;
  one.threads = 1;
  four.threads = 4;
  const ScanSurface a = AnalyzeScan(checked, ScanOptions{}, one).value();
  const ScanSurface b = AnalyzeScan(checked, ScanOptions{}, four).value();
  ASSERT_FALSE(a.graph.differences.empty());
  EXPECT_EQ(a.cloud.points, b.cloud.points);
  EXPECT_EQ(a.cloud.normals, b.cloud.normals);
  EXPECT_EQ(a.cloud.noise, b.cloud.noise);
  EXPECT_EQ(a.graph.differences, b.graph.differences);
  EXPECT_EQ(a.graph.far_lists, b.graph.far_lists);
  for (int i = 0; i < a.index.size(); i += 997) {
    int nearest = -1, again = -1;
    double squared = 1, squared_again = 1;
    a.index.Nearest(a.cloud.points.col(i), 1, &nearest, &squared);
    b.index.Nearest(b.cloud.points.col(i), 1, &again, &squared_again);
    EXPECT_EQ(nearest, i);
    EXPECT_EQ(again, i);
  }
}

}  // namespace
}  // namespace rilievo
