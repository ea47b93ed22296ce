#include "core/scan/orientation/orient_normals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/scan/clean/check_scan.h"
#include "core/scan/scan_surface.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"
#include "tests/scans/scene.h"
#include "tests/scans/scene_scanner.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

ScanSurface Analyze(const PointCloud& scan, int threads = 2) {
  RunContext context;
  context.threads = threads;
  const CheckedScan checked = CheckScan(scan, CheckOptions{}, context).value();
  return AnalyzeScan(checked, ScanOptions{}, context).value();
}

PointCloud Sample(const AnalyticShape& shape, int points, double noise = 0) {
  ScannerOptions options;
  options.points = points;
  options.views = 0;
  options.noise = noise;
  return SimulateScan(shape, options).value().cloud;
}

// Share of normals that point inward.
double Wrong(const AnalyticShape& shape, const ScanSurface& scan) {
  int wrong = 0;
  for (int i = 0; i < scan.cloud.points.cols(); ++i) {
    const Eigen::Vector3d x = scan.frame.ScanFromUnit(scan.cloud.points.col(i));
    wrong += shape.Normal(x).dot(scan.cloud.normals.col(i)) < 0;
  }
  return static_cast<double>(wrong) / static_cast<double>(scan.cloud.points.cols());
}

TEST(OrientationTest, ClosedShapesPointOutward) {
  for (const char* name : {"sphere", "torus", "genus2", "pair", "star"}) {
    const ShapePtr shape = MakeShape(name).value();
    EXPECT_EQ(Wrong(*shape, Analyze(Sample(*shape, 20000))), 0) << name;
    EXPECT_LT(Wrong(*shape, Analyze(Sample(*shape, 20000, 0.002))), 0.001) << name;
  }
}

TEST(OrientationTest, SharpEdgesAreCrossedRightly) {
  const ShapePtr box = MakeCutBox();
  EXPECT_LT(Wrong(*box, Analyze(Sample(*box, 30000))), 0.003);
}

TEST(OrientationTest, AnOpenTerrainPointsUp) {
  const ShapePtr terrain = MakeTerrain();
  EXPECT_EQ(Wrong(*terrain, Analyze(Sample(*terrain, 20000))), 0);
}

// Cars stand on their shadows, facades hang together by their windows: the votes of neighbours
// alone turn one of them or another.
TEST(OrientationTest, AStreetFacesTheScannersThatItDoesNotKnow) {
  const SceneScan street = ScanScene(MakeStreet(), {.points = 60000}).value();
  const PointSights& sights = street.cloud.sights;
  const CheckedScan checked = CheckScan({street.cloud.points}, CheckOptions{}, {}).value();
  const std::vector<int> source(checked.source_index.begin(), checked.source_index.end());
  const ScanSurface scan = AnalyzeScan(checked, ScanOptions{}, {}).value();
  int away = 0, place = 0;
  for (size_t i = 0; i < source.size(); ++i) {
    if (!scan.keep.empty() && scan.keep[i] == 0) continue;
    const Eigen::Vector3d station = sights.stations.col(sights.station_of[source[i]]);
    away += (station - street.cloud.points.col(source[i])).dot(scan.cloud.normals.col(place++)) < 0;
  }
  ASSERT_EQ(place, scan.cloud.points.cols());
  EXPECT_LT(away, 0.02 * place);
}

// Nine windows, set back by four spacings; nobody saw their reveals.
TEST(OrientationTest, AWindowFacesTheWayOfItsWall) {
  for (const double noise : {0.0, 0.002}) {
    KnownCloud wall = PlaneCloud(20000, 11);
    for (auto point : wall.cloud.points.colwise()) {
      const Eigen::Array2d place = 3 * point.head<2>().array();
      if (((place - place.floor() - 0.5).abs() < 0.2).all()) point.z() -= 0.03;
    }
    AddNoise(noise, 12, &wall);
    const ScanSurface scan = Analyze(wall.cloud);
    const auto up = (scan.cloud.normals.row(2).array() > 0).count();
    const auto all = static_cast<double>(scan.cloud.points.cols());
    EXPECT_NEAR(std::abs(2 * static_cast<double>(up) / all - 1), 1, 0.002) << noise;
  }
}

// Two spacings thick, five times the noise: neighbours come from both sides.
TEST(OrientationTest, AThinPlateUnderNoiseHasTwoSides) {
  constexpr int kPlatePoints = 20000;
  const double spacing = std::sqrt(4 * 2 / std::numbers::pi / kPlatePoints);
  KnownCloud plate = BoxCloud(kPlatePoints, 3, {1, 1, 2 * spacing});
  AddNoise(0.4 * spacing, 5, &plate);
  const CheckedScan checked = CheckScan(plate.cloud, CheckOptions{}, RunContext{}).value();
  ScanOptions options;
  options.outliers.distance_factor = 0;
  const ScanSurface scan = AnalyzeScan(checked, options, RunContext{}).value();
  ASSERT_EQ(scan.cloud.points.cols(), kPlatePoints);
  EXPECT_LT(WrongShare(scan.cloud.normals, plate.normals(Eigen::all, checked.source_index)), 0.08);
  EXPECT_NEAR(scan.cloud.median_noise, 0.4 * spacing / scan.frame.diagonal,
              0.1 * spacing / scan.frame.diagonal);
}

// A shell of two spheres three spacings apart: outward on the outer, inward on the inner.
TEST(OrientationTest, AThinShellHasTwoSides) {
  const PointCloud sphere = Sample(*MakeSphere(), 40000);
  const double spacing = std::sqrt(4 * std::numbers::pi / 20000);
  PointCloud shell = sphere;
  for (int i = 0; i < 20000; ++i) shell.points.col(i) *= 1 - 3 * spacing;
  const ScanSurface scan = Analyze(shell);
  int wrong = 0;
  for (int i = 0; i < scan.cloud.points.cols(); ++i) {
    const Eigen::Vector3d x = scan.frame.ScanFromUnit(scan.cloud.points.col(i));
    const double side = x.norm() > 1 - 1.5 * spacing ? 1 : -1;
    wrong += side * x.dot(scan.cloud.normals.col(i)) < 0;
  }
  EXPECT_LT(wrong, 0.002 * 40000);
}

TEST(OrientationTest, AMoebiusBandEndsAndDisagrees) {
  PointCloud band;
  band.points.resize(3, 6000);
  for (int i = 0; i < 6000; ++i) {
    const double turn = 2 * std::numbers::pi * (i + 0.5) / 6000;
    const double across = 0.6 * (std::fmod(i * std::numbers::phi, 1.0) - 0.5);
    const double radius = 1 + across * std::cos(turn / 2);
    band.points.col(i) << radius * std::cos(turn), radius * std::sin(turn),
        across * std::sin(turn / 2);
  }
  const ScanSurface scan = Analyze(band);
  EXPECT_GT(scan.figures.orientation.disagreement, 0);
  EXPECT_LT(scan.figures.orientation.disagreement, 0.1);
}

TEST(OrientationTest, TheNumberOfThreadsDoesNotChangeABit) {
  const PointCloud scan = Sample(*MakeGenus2(), 10000, 0.001);
  EXPECT_EQ(Analyze(scan, 1).cloud.normals, Analyze(scan, 3).cloud.normals);
}

}  // namespace
}  // namespace rilievo
