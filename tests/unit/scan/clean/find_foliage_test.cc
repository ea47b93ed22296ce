#include "core/scan/clean/find_foliage.h"

#include <gtest/gtest.h>

#include "core/scan/scan_surface.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/random.h"
#include "tests/scans/scanner.h"
#include "tests/scans/scene.h"
#include "tests/scans/scene_scanner.h"

namespace rilievo {
namespace {

TEST(FindFoliageTest, LeavesGoAndTheGardenStays) {
  const SceneScan scan = ScanScene(MakeGarden(), {.points = 20000, .noise = 0.0002}).value();
  const CheckedScan checked = CheckScan(scan.cloud, CheckOptions{}, RunContext{}).value();
  const ScanSurface surface = AnalyzeScan(checked, ScanOptions{}, RunContext{}).value();
  ASSERT_EQ(surface.keep.size(), checked.source_index.size());
  int leaves = 0, leaves_left = 0, others = 0, others_gone = 0;
  for (size_t i = 0; i < surface.keep.size(); ++i) {
    if (scan.is_leaf[checked.source_index[i]] != 0) {
      ++leaves;
      leaves_left += surface.keep[i];
    } else {
      ++others;
      others_gone += surface.keep[i] == 0;
    }
  }
  EXPECT_GT(leaves, 1000);
  EXPECT_LT(leaves_left, 0.05 * leaves);
  EXPECT_LT(others_gone, 0.02 * others);
  EXPECT_GT(surface.figures.foliage_points, 0.9 * leaves);
  EXPECT_EQ(surface.figures.kept, surface.cloud.points.cols());
}

TEST(FindFoliageTest, LeavesStayWhereNothingIsToBeLeftOut) {
  const SceneScan scan = ScanScene(MakeGarden(), {.points = 10000}).value();
  ScanOptions options;
  options.outliers.distance_factor = 0;
  const CheckedScan checked = CheckScan(scan.cloud, CheckOptions{}, RunContext{}).value();
  EXPECT_EQ(AnalyzeScan(checked, options, RunContext{})->figures.foliage_points, 0);
}

bool MayHoldLeaves(const PointCloud& cloud) {
  const CheckedScan checked = CheckScan(cloud, CheckOptions{}, RunContext{}).value();
  const ScanNeighbors found = FindNeighbors(checked, ScanOptions{}, RunContext{}).value();
  return MayHoldFoliage(found.points, found.graph, RunContext{}).value();
}

TEST(FindFoliageTest, NormalsAreNotAskedForWhereNothingFillsAVolume) {
  EXPECT_TRUE(MayHoldLeaves(ScanScene(MakeGarden(), {.points = 10000})->cloud));
  PointCloud sphere;
  sphere.points.resize(3, 10000);
  Random random(1);
  for (auto point : sphere.points.colwise()) {
    point = Eigen::Vector3d(random.Normal(), random.Normal(), random.Normal()).normalized();
  }
  EXPECT_FALSE(MayHoldLeaves(sphere));
}

int64_t FoliageOf(const PointCloud& cloud) {
  const CheckedScan checked = CheckScan(cloud, CheckOptions{}, RunContext{}).value();
  return AnalyzeScan(checked, ScanOptions{}, RunContext{})->figures.foliage_points;
}

// A square of side 100 with a point on each unit of area. Right of x = 70 they have noise.
TEST(FindFoliageTest, NoiseOfAPartOfTheScanIsNone) {
  PointCloud cloud;
  cloud.points.resize(3, 10000);
  Random random(1);
  for (auto point : cloud.points.colwise()) {
    point << random.Uniform(0, 100), random.Uniform(0, 100), 0.01 * random.Normal();
    if (point.x() > 70) point.z() = 0.7 * random.Normal();
  }
  EXPECT_EQ(FoliageOf(cloud), 0);
}

// The same noise everywhere, as thick as the spacing where the points are ten times as dense.
TEST(FindFoliageTest, NoiseOfADensePartIsNone) {
  PointCloud cloud;
  cloud.points.resize(3, 14000);
  Random random(1);
  for (int i = 0; i < cloud.points.cols(); ++i) {
    const double side = i < 10000 ? 100 : 6;
    cloud.points.col(i) << random.Uniform(0, side), random.Uniform(0, side), 0.07 * random.Normal();
  }
  EXPECT_EQ(FoliageOf(cloud), 0);
}

TEST(FindFoliageTest, HousesAndThinWallsAreSurfaces) {
  EXPECT_EQ(FoliageOf(ScanScene(MakeBlock(), {.points = 10000}).value().cloud), 0);
  for (const double noise : {0.0, 0.003}) {
    const auto walls = MakeThinWalls();
    const auto scan = SimulateScan(*walls, {.points = 10000, .noise = noise});
    EXPECT_EQ(FoliageOf(scan->cloud), 0) << noise;
  }
}

}  // namespace
}  // namespace rilievo
