#include "core/displacement/rays/ray_cloud.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

RayCloud Prepare(const Scan& scan) {
  return *PrepareRayCloud(scan.cloud, scan.graph, RunContext());
}

TEST(MakeRayTest, FrameIsRightHanded) {
  for (int i = 0; i < 50; ++i) {
    const Ray ray = MakeRay({0.1, 0.2, 0.3}, SpiralDirection(i, 50));
    EXPECT_NEAR((ray.u.cross(ray.v) - ray.direction).norm(), 0, 1e-6);
    EXPECT_NEAR(ray.u.norm(), 1, 1e-6);
    EXPECT_NEAR(ray.u.dot(ray.direction), 0, 1e-6);
  }
}

TEST(PrepareRayCloudTest, OnlyThePointsOffTheSurfaceAreStrays) {
  Points points = SpherePoints(0.3, 5000);
  const int surface_points = static_cast<int>(points.at.size());
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d direction = SpiralDirection(i, 20);
    points.Add(0.35 * direction, direction);
  }
  const RayCloud cloud = Prepare(MakeScan(points.Positions(), points.Normals(), 0));
  EXPECT_EQ(cloud.outliers, 20);
  for (int i = 0; i < static_cast<int>(cloud.points.size()); ++i) {
    EXPECT_EQ(std::isnan(cloud.points[i].normal[0]), i >= surface_points) << i;
  }
}

TEST(PrepareRayCloudTest, PointsOfAThinWallAreNone) {
  Random random(1);
  const auto flat = [](double, double) { return 0.0; };
  Points points = HeightFieldPoints(0.3, 4900, &random, flat);
  const Points back = HeightFieldPoints(0.3, 4900, &random, flat);
  for (size_t i = 0; i < back.at.size(); ++i) {
    points.Add(back.at[i] - Eigen::Vector3d(0, 0, 0.008), -back.normal[i]);
  }
  EXPECT_EQ(Prepare(MakeScan(points.Positions(), points.Normals(), 0)).outliers, 0);
}

TEST(PrepareRayCloudTest, AnEdgeAddsNoNoiseWhereTheScanHasNone) {
  Random random(2);
  const Points points =
      HeightFieldPoints(0.3, 10000, &random, [](double x, double) { return -std::abs(x); });
  Scan scan = MakeScan(points.Positions(), points.Normals(), 1e-4);
  for (int i = 0; i < scan.cloud.points.cols(); ++i) {  // what a quadric over the edge leaves
    if (std::abs(scan.cloud.points(0, i)) < 0.006) scan.cloud.noise[i] = 2e-3f;
  }
  for (const RayPoint& point : Prepare(scan).points) EXPECT_FLOAT_EQ(point.noise, 1e-4f);
}

TEST(PrepareRayCloudTest, NoiseOfARegionIsKept) {
  Random random(3);
  const Points points = HeightFieldPoints(0.3, 10000, &random, [](double, double) { return 0.0; });
  Scan scan = MakeScan(points.Positions(), points.Normals(), 1e-4);
  for (int i = 0; i < scan.cloud.points.cols(); ++i) {
    if (scan.cloud.points(0, i) > 0) scan.cloud.noise[i] = 1e-3f;
  }
  const RayCloud cloud = Prepare(scan);
  for (const RayPoint& point : cloud.points) {
    if (std::abs(point.position[0]) < 0.03) continue;
    EXPECT_FLOAT_EQ(point.noise, point.position[0] > 0 ? 1e-3f : 1e-4f);
  }
}

}  // namespace
}  // namespace rilievo
