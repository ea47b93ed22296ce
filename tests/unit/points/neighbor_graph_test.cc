#include "core/points/neighbor_graph.h"

#include <gtest/gtest.h>

#include <stop_token>
#include <utility>

#include "tests/unit/points/brute_force.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

TEST(NeighborGraphTest, ListsMatchBruteForceWithoutThePointItself) {
  const Eigen::Matrix3Xd points = SphereCloud(700, 5).cloud.points;
  const auto graph =
      BuildNeighborGraph(PointIndex(points), points, NeighborOptions{}, RunContext{});
  ASSERT_TRUE(graph.ok());
  EXPECT_EQ(graph->k, 16);
  EXPECT_EQ(graph->size(), 700);
  for (int i = 0; i < 700; ++i) {
    const auto expected = BruteForce(points, points.col(i));
    ASSERT_EQ(expected[0].second, i);
    const std::vector<float> distances = NeighborDistances(points, *graph, i);
    ASSERT_EQ(distances.size(), 16u);
    for (int j = 0; j < 16; ++j) {
      ASSERT_EQ(graph->neighbors(i)[j], expected[j + 1].second);
      ASSERT_FLOAT_EQ(distances[j], static_cast<float>(std::sqrt(expected[j + 1].first)));
    }
  }
}

// More points in one place than neighbours asked for: the point itself may not be in the answer.
TEST(NeighborGraphTest, DuplicatesDoNotListThemselves) {
  const Eigen::Matrix3Xd points = SphereCloud(30, 6).cloud.points.replicate(1, 20);
  const auto graph =
      BuildNeighborGraph(PointIndex(points), points, NeighborOptions{}, RunContext{});
  ASSERT_TRUE(graph.ok());
  for (int i = 0; i < graph->size(); ++i) {
    for (const int j : graph->neighbors(i)) ASSERT_NE(j, i);
    for (const float distance : NeighborDistances(points, *graph, i)) ASSERT_EQ(distance, 0);
  }
}

TEST(NeighborGraphTest, SmallSetsHaveFewerNeighbours) {
  const Eigen::Matrix3Xd points = SphereCloud(10, 7).cloud.points;
  const auto graph =
      BuildNeighborGraph(PointIndex(points), points, NeighborOptions{}, RunContext{});
  ASSERT_TRUE(graph.ok());
  EXPECT_EQ(graph->k, 9);
  EXPECT_EQ(graph->size(), 10);
}

// Cut in two halves of more points than a difference can tell apart: the lists along the cut and
// those within the halves.
TEST(NeighborGraphTest, PackedListsAreTheSame) {
  const int count = 80'000;
  NeighborGraph graph;
  graph.k = 6;
  for (int i = 0; i < count; ++i) {
    for (int j = 1; j <= graph.k; ++j) {
      const int step = i % 100 == 0 ? count / 2 : j % 2 == 0 ? j : count - j;
      graph.indices.push_back((i + step) % count);
    }
  }
  NeighborGraph packed = graph;
  std::stop_source stop;
  stop.request_stop();
  RunContext stopped;
  stopped.stop = stop.get_token();
  EXPECT_EQ(packed.Pack(stopped).code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(packed.indices, graph.indices);
  ASSERT_TRUE(packed.Pack(RunContext{}).ok());
  EXPECT_TRUE(packed.indices.empty());
  EXPECT_LT(packed.far_lists.size(), graph.indices.size() / 50);
  ASSERT_EQ(packed.size(), graph.size());
  for (int i = 0; i < count; ++i) {
    const NeighborList list = packed.neighbors(i), expected = graph.neighbors(i);
    ASSERT_TRUE(std::equal(list.begin(), list.end(), expected.begin(), expected.end())) << i;
  }
}

// Too short for the mark of a far one.
TEST(NeighborGraphTest, ShortListsStayAsTheyAre) {
  const Eigen::Matrix3Xd points = SphereCloud(3, 7).cloud.points;
  NeighborGraph graph =
      BuildNeighborGraph(PointIndex(points), points, NeighborOptions{}, RunContext{}).value();
  ASSERT_TRUE(graph.Pack(RunContext{}).ok());
  EXPECT_EQ(graph.size(), 3);
  EXPECT_EQ(graph.indices.size(), 6u);
}

TEST(NeighborGraphTest, SameForAnyThreadCount) {
  const Eigen::Matrix3Xd points = TorusCloud(6000, 8).cloud.points;
  const PointIndex index(points);
  RunContext one, three;
  one.threads = 1;
  three.threads = 3;
  const auto a = BuildNeighborGraph(index, points, NeighborOptions{}, one);
  const auto b = BuildNeighborGraph(index, points, NeighborOptions{}, three);
  ASSERT_TRUE(a.ok() && b.ok());
  EXPECT_EQ(a->indices, b->indices);
}

TEST(NeighborGraphTest, RefusesBadOptionsAndStops) {
  const Eigen::Matrix3Xd points = SphereCloud(100, 9).cloud.points;
  const PointIndex index(points);
  NeighborOptions options;
  for (const int k : {5, 65, -1}) {
    options.k = k;
    EXPECT_EQ(BuildNeighborGraph(index, points, options, RunContext{}).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(BuildNeighborGraph(index, points.leftCols(50), NeighborOptions{}, RunContext{})
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(BuildNeighborGraph(index, points, NeighborOptions{}, context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
