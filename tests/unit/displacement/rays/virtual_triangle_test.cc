#include "core/displacement/rays/virtual_triangle.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace rilievo {
namespace {

const Ray kUp = {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}};

struct Corners {
  RayCloud cloud;
  std::vector<QueuedPoint> queue;
  void Add(float u, float v, float height, Eigen::Vector3f normal = {0, 0, 1}) {
    normal.normalize();
    cloud.points.push_back({{u, v, height}, {normal[0], normal[1], normal[2]}, 1.0f, 0.0f});
    queue.push_back({static_cast<int>(queue.size()), u, v, height, u * u + v * v});
  }
  std::optional<VirtualTriangle> Find(const TriangleRules& rules = TriangleRules()) {
    std::sort(queue.begin(), queue.end(), [](auto& a, auto& b) { return a.key < b.key; });
    return FindVirtualTriangle(queue, cloud, kUp, rules);
  }
};

TEST(VirtualTriangleTest, HeightIsThatOfThePlaneThroughTheThreeNearest) {
  Corners corners;
  const auto plane = [](float u, float v) { return 0.3f + 0.2f * u - 0.4f * v; };
  for (const auto& [u, v] : {std::pair{0.5f, 0.1f}, {-0.4f, 0.5f}, {-0.3f, -0.6f}}) {
    corners.Add(u, v, plane(u, v), {-0.2f, 0.4f, 1});
  }
  corners.Add(1.5f, 1.5f, 100);  // farther away: not asked
  const auto triangle = corners.Find();
  ASSERT_TRUE(triangle.has_value());
  EXPECT_NEAR(triangle->height, 0.3f, 1e-6);
  EXPECT_NEAR(triangle->barycentric[0] + triangle->barycentric[1] + triangle->barycentric[2], 1,
              1e-6);
  for (float weight : triangle->barycentric) EXPECT_GE(weight, 0);
}

TEST(VirtualTriangleTest, GoesOnUntilARayIsEnclosed) {
  Corners corners;
  for (float v : {-0.4f, 0.0f, 0.4f}) corners.Add(0.3f, v, 1);  // all on one side
  EXPECT_FALSE(corners.Find().has_value());
  corners.Add(-0.9f, 0.05f, 1);
  ASSERT_TRUE(corners.Find().has_value());
  EXPECT_NEAR(corners.Find()->height, 1, 1e-6);
}

TEST(VirtualTriangleTest, OfSeveralThatTheNewPointClosesTheSmallestCounts) {
  Corners corners;
  corners.Add(0.1f, 0.3f, 0);
  corners.Add(0.1f, -0.3f, 0);
  corners.Add(0.2f, 0.6f, 0.2f);
  corners.Add(-0.7f, 0,
              0);  // closes with 0 and 1 (area 0.24) and with 2 and 1 (more)
  const auto triangle = corners.Find();
  ASSERT_TRUE(triangle.has_value());
  EXPECT_NEAR(triangle->area, 0.24f, 1e-5);
  EXPECT_NEAR(triangle->height, 0, 1e-6);
}

TEST(VirtualTriangleTest, ARayThroughAPointTakesItsHeight) {
  Corners corners;
  corners.Add(0, 0, 0.25f);
  corners.Add(1, 0, 0.5f);
  corners.Add(0, 1, 0.5f);
  ASSERT_TRUE(corners.Find().has_value());
  EXPECT_NEAR(corners.Find()->height, 0.25f, 1e-6);
}

TEST(VirtualTriangleTest, TooLongEdgesSpanAHole) {
  Corners corners;
  corners.Add(2.2f, 0, 0);
  corners.Add(-2.2f, 2.2f, 0);
  corners.Add(-2.2f, -2.2f, 0);
  EXPECT_FALSE(corners.Find().has_value());
  EXPECT_TRUE(corners.Find({.max_spacings = 5}).has_value());
}

TEST(VirtualTriangleTest, ATriangleAgainstItsNormalsIsNone) {
  Corners corners;  // steep triangle, corners that say the surface is level
  corners.Add(0.3f, 0, 0.9f);
  corners.Add(-0.3f, 0.3f, -0.9f);
  corners.Add(-0.3f, -0.3f, -0.9f);
  EXPECT_FALSE(corners.Find().has_value());
  EXPECT_TRUE(corners.Find({.noisy = true}).has_value());
}

TEST(VirtualTriangleTest, CollinearPointsEncloseNothing) {
  Corners corners;
  for (float u : {-0.5f, 0.0f, 0.5f, 1.0f}) corners.Add(u, 0, 0);
  EXPECT_FALSE(corners.Find().has_value());
}

TEST(VirtualTriangleTest, FewerThanThreePointsAreNone) {
  Corners corners;
  EXPECT_FALSE(corners.Find().has_value());
  corners.Add(0, 0, 0);
  corners.Add(1, 0, 0);
  EXPECT_FALSE(corners.Find().has_value());
}

}  // namespace
}  // namespace rilievo
