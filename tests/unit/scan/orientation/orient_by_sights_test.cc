// Normals that face the places that their points were seen from, or have the side of given ones.
#include <gtest/gtest.h>

#include <cmath>

#include "core/scan/orientation/orient_normals.h"
#include "core/scan/scan_surface.h"
#include "tests/scans/random.h"
#include "tests/scans/scene_scanner.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

ScanSurface AnalyzeSeen(const PointCloud& scan, const SightOptions& sights = {}, int threads = 2) {
  RunContext context;
  context.threads = threads;
  ScanOptions options;
  options.sights = sights;
  return AnalyzeScan(CheckScan(scan, CheckOptions{}, context).value(), options, context).value();
}

// Share of points whose normal turns away from their station.
double AwayFromStations(const PointCloud& scan, const ScanSurface& surface) {
  const PointIndex index(scan.points);
  int away = 0;
  for (Eigen::Index i = 0; i < surface.cloud.points.cols(); ++i) {
    const Eigen::Vector3d place = surface.frame.ScanFromUnit(surface.cloud.points.col(i));
    int nearest = 0;
    double squared = 0;
    index.Nearest(place, 1, &nearest, &squared);
    const auto station = scan.sights.stations.col(scan.sights.station_of[nearest]);
    away += surface.cloud.normals.col(i).dot(station - place) < 0;
  }
  return static_cast<double>(away) / static_cast<double>(surface.cloud.points.cols());
}

PointCloud Rooms(double noise) {
  return ScanScene(MakeRooms(), {.points = 40'000, .noise = noise}).value().cloud;
}

TEST(OrientBySightsTest, RoomsScannedFromInsideFaceIn) {
  for (const double noise : {0.0, 0.001}) {
    const PointCloud rooms = Rooms(noise);
    const ScanSurface surface = AnalyzeSeen(rooms);
    EXPECT_TRUE(surface.figures.orientation.stations.used);
    EXPECT_LT(AwayFromStations(rooms, surface), noise > 0 ? 0.01 : 0.002) << noise;
    const SightOptions ignore = {.stations = SightRule::kIgnore};
    EXPECT_GT(AwayFromStations(rooms, AnalyzeSeen(rooms, ignore)), 0.2) << "what there is to gain";
  }
}

// A sphere, seen from `place` alone or not at all.
KnownCloud SphereSeenFrom(const Eigen::Vector3d& place) {
  KnownCloud sphere = SphereCloud(6000, 1);
  sphere.cloud.sights.stations = place;
  sphere.cloud.sights.station_of.assign(6000, 0);
  return sphere;
}

TEST(OrientBySightsTest, AClosedSurfaceSeenFromInsideFacesIn) {
  const KnownCloud sphere = SphereSeenFrom({0.2, 0.1, 0});
  const ScanSurface surface = AnalyzeSeen(sphere.cloud);
  EXPECT_GT(surface.figures.orientation.stations.consistency, 0.99);
  EXPECT_EQ(AwayFromStations(sphere.cloud, surface), 0);
}

TEST(OrientBySightsTest, AStationThatCannotHaveSeenTheScanIsNotBelieved) {
  for (const double distance : {1.2, 3.0, 1000.0}) {
    const KnownCloud sphere = SphereSeenFrom({0, 0, distance});
    const ScanSurface surface = AnalyzeSeen(sphere.cloud);
    const SightFigures& stations = surface.figures.orientation.stations;
    EXPECT_EQ(stations.points, 6000);
    EXPECT_LT(stations.consistency, 0.1) << distance;
    EXPECT_FALSE(stations.used);
    EXPECT_TRUE(surface.cloud.normals == AnalyzeSeen(SphereCloud(6000, 1).cloud).cloud.normals);
  }
}

KnownCloud TorusWithNormals(double factor) {
  KnownCloud torus = TorusCloud(8000, 2);
  torus.cloud.sights.normals = (factor * torus.normals).cast<float>();
  return torus;
}

TEST(OrientBySightsTest, GivenNormalsGiveTheSide) {
  for (const double side : {1.0, -1.0}) {
    const KnownCloud torus = TorusWithNormals(side);
    const CheckedScan checked = CheckScan(torus.cloud, CheckOptions{}, RunContext{}).value();
    const ScanSurface surface = AnalyzeScan(checked, ScanOptions{}, RunContext{}).value();
    EXPECT_TRUE(surface.figures.orientation.normals.used);
    EXPECT_GT(surface.figures.orientation.normals.alignment, 0.98);
    const Eigen::Matrix3Xd truth = side * torus.normals(Eigen::all, checked.source_index);
    ASSERT_EQ(surface.cloud.normals.cols(), truth.cols());
    EXPECT_EQ(WrongShare(surface.cloud.normals, truth), 0);
  }
}

TEST(OrientBySightsTest, NormalsThatAreNoneAreNotBelieved) {
  const ScanSurface plain = AnalyzeSeen(TorusCloud(8000, 2).cloud);
  Random random(7);
  KnownCloud other = TorusWithNormals(1), either = other, longer = TorusWithNormals(3);
  for (int i = 0; i < 8000; ++i) {
    other.cloud.sights.normals.col(i) = RandomDirection(&random).cast<float>();
    if (random.Uniform() < 0.5) either.cloud.sights.normals.col(i) *= -1;
  }
  for (const KnownCloud& torus : {other, either, longer}) {
    const ScanSurface surface = AnalyzeSeen(torus.cloud);
    EXPECT_EQ(surface.figures.orientation.normals.points, 8000);
    EXPECT_FALSE(surface.figures.orientation.normals.used);
    EXPECT_TRUE(surface.cloud.normals == plain.cloud.normals);
  }
}

// A tenth of the normals turned round at random does not turn the surface anywhere.
TEST(OrientBySightsTest, NeighboursOutvoteAFewWrongNormals) {
  KnownCloud torus = TorusWithNormals(-1);
  Random random(5);
  for (int i = 0; i < 8000; ++i) {
    if (random.Uniform() < 0.1) torus.cloud.sights.normals.col(i) *= -1;
  }
  const CheckedScan checked = CheckScan(torus.cloud, CheckOptions{}, RunContext{}).value();
  const ScanSurface surface = AnalyzeScan(checked, ScanOptions{}, RunContext{}).value();
  EXPECT_TRUE(surface.figures.orientation.normals.used);
  const Eigen::Matrix3Xd truth = -torus.normals(Eigen::all, checked.source_index);
  EXPECT_LT(WrongShare(surface.cloud.normals, truth), 0.001);
}

TEST(OrientBySightsTest, TheNumberOfThreadsDoesNotChangeABit) {
  const PointCloud rooms = Rooms(0.001);
  EXPECT_TRUE(AnalyzeSeen(rooms, {}, 1).cloud.normals == AnalyzeSeen(rooms, {}, 3).cloud.normals);
}

}  // namespace
}  // namespace rilievo
