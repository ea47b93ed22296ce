#include "core/displacement/rays/neighbor_queue.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

constexpr float kEverywhere = std::numeric_limits<float>::max();

QueueGate OpenGate() {
  QueueGate gate;
  gate.max_height = 0.1f;
  gate.min_normal_agreement = 0.2f;
  gate.height_window = kEverywhere;
  return gate;
}

struct SphereQueue : ::testing::Test {
  SphereQueue() {
    const Points points = SpherePoints(0.3, 4000);
    scan = MakeScan(points.Positions(), points.Normals(), 0);
    cloud = *PrepareRayCloud(scan.cloud, scan.graph, RunContext());
  }
  // By looking at all points: those the gate lets in, nearest to the ray first.
  std::vector<int> BruteForce(const Ray& ray) const {
    std::vector<std::pair<double, int>> found;
    for (int i = 0; i < scan.cloud.points.cols(); ++i) {
      const Eigen::Vector3d off = scan.cloud.points.col(i) - ray.origin.cast<double>();
      const Eigen::Vector3d direction = ray.direction.cast<double>();
      const double height = off.dot(direction);
      if (std::abs(height) > 0.1 || scan.cloud.normals.col(i).dot(direction) <= 0.2) continue;
      found.push_back({off.squaredNorm() - height * height, i});
    }
    std::sort(found.begin(), found.end());
    std::vector<int> order;
    for (const auto& entry : found) order.push_back(entry.second);
    return order;
  }
  // The first point of the cloud that lies within 60 degrees of the direction.
  int Facing(const Eigen::Vector3d& direction) const {
    int point = 0;
    while (scan.cloud.normals.col(point).dot(direction) < 0.5) ++point;
    return point;
  }
  Scan scan = {{}, PointIndex(Eigen::Matrix3Xd::Zero(3, 1)), {}};
  RayCloud cloud;
};

TEST_F(SphereQueue, FromAnyPointOfItsSideTheWalkEndsAtTheRay) {
  NeighborQueue queue(cloud, scan.graph);
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d direction = SpiralDirection(i, 40);
    const Ray ray = MakeRay(0.28 * direction, direction);
    const int nearest = BruteForce(ray).front();
    for (int start = 0; start < 4000; start += 37) {
      if (scan.cloud.normals.col(start).dot(direction) < 0.5) continue;
      QueueGate gate = OpenGate();
      EXPECT_EQ(queue.Walk(ray, start, &gate), nearest) << i << " from " << start;
    }
  }
}

TEST_F(SphereQueue, TheNearestOfTheQueueAreTheNearestOfAll) {
  NeighborQueue queue(cloud, scan.graph);
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d direction = SpiralDirection(i, 40);
    const Ray ray = MakeRay(0.28 * direction, direction);
    QueueGate gate = OpenGate();
    queue.Start(ray, gate, queue.Walk(ray, Facing(direction), &gate));
    queue.Grow(60, kEverywhere);
    const std::vector<int> expected = BruteForce(ray);
    const auto sorted = queue.Sorted();
    ASSERT_GE(sorted.size(), 60u);
    for (int k = 0; k < 30; ++k) EXPECT_EQ(sorted[k].point, expected[k]) << k;
  }
}

TEST_F(SphereQueue, CoveringMissesHardlyAny) {
  NeighborQueue queue(cloud, scan.graph);
  int missed = 0;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d direction = SpiralDirection(i, 40);
    const Ray ray = MakeRay(0.28 * direction, direction);
    QueueGate gate = OpenGate();
    gate.covered_ranks = 5;
    queue.Start(ray, gate, queue.Walk(ray, Facing(direction), &gate));
    queue.Grow(250, kEverywhere);
    std::set<int> pulled;
    for (const QueuedPoint& point : queue.queued()) pulled.insert(point.point);
    const std::vector<int> expected = BruteForce(ray);
    for (int k = 0; k < 160; ++k) missed += !pulled.contains(expected[k]);
  }
  EXPECT_LT(missed, 40 * 160 / 100);
}

TEST_F(SphereQueue, HoldsNoPointTwiceAndKeepsItsGates) {
  NeighborQueue queue(cloud, scan.graph);
  const Ray ray = MakeRay({0, 0, 0.28}, {0, 0, 1});
  QueueGate gate = OpenGate();
  gate.min_normal_agreement = 0.9f;
  queue.Start(ray, gate, queue.Walk(ray, Facing({0, 0, 1}), &gate));
  EXPECT_FALSE(queue.Grow(4000, kEverywhere));
  std::set<int> seen;
  for (const QueuedPoint& point : queue.queued()) {
    EXPECT_TRUE(seen.insert(point.point).second);
    EXPECT_GT(scan.cloud.normals(2, point.point), 0.9);
  }
  // The cap of a sphere above z = 0.9 has a twentieth of its area (Archimedes).
  EXPECT_EQ(seen.size(), 200u);
}

TEST_F(SphereQueue, RadiusEndsTheGrowth) {
  NeighborQueue queue(cloud, scan.graph);
  const Ray ray = MakeRay({0, 0, 0.28}, {0, 0, 1});
  QueueGate gate = OpenGate();
  queue.Start(ray, gate, queue.Walk(ray, Facing({0, 0, 1}), &gate));
  EXPECT_FALSE(queue.Grow(4000, 0.03f));
  // The cap within that radius holds ten points of the 4000; their neighbours come with them.
  const auto inside = std::count_if(queue.queued().begin(), queue.queued().end(),
                                    [](const QueuedPoint& p) { return p.key < 0.03f * 0.03f; });
  EXPECT_NEAR(static_cast<double>(inside), 4000 * (1 - std::sqrt(1 - 0.01)) / 2, 2);
  EXPECT_LT(queue.queued().size(), 60u);
}

TEST(NeighborQueueTest, TheWalkClimbsASlantedSurfaceToTheRay) {
  Random random(1);
  const Points points =
      HeightFieldPoints(0.2, 10000, &random, [](double x, double) { return 1.5 * x; });
  const Scan scan = MakeScan(points.Positions(), points.Normals(), 0);
  const RayCloud cloud = *PrepareRayCloud(scan.cloud, scan.graph, RunContext());
  const NeighborQueue queue(cloud, scan.graph);
  const Ray ray = MakeRay({0.15, 0, 0}, {0, 0, 1});  // the surface is 0.225 above
  QueueGate gate = OpenGate();
  gate.max_height = 0.4f;
  gate.height_weight = 0.25f;
  const int end = queue.Walk(ray, 0, &gate);
  EXPECT_LT(std::hypot(cloud.points[end].position[0] - 0.15f, cloud.points[end].position[1]),
            2 * scan.cloud.median_spacing);
  EXPECT_NEAR(gate.reference_height, 0.225, 4 * scan.cloud.median_spacing);
}

}  // namespace
}  // namespace rilievo
