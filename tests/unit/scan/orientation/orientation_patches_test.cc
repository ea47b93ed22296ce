#include "core/scan/orientation/orientation_patches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "core/scan/local_shape/estimate_normals.h"
#include "core/scan/orientation/edge_sign_votes.h"

namespace rilievo {
namespace {

struct Scene {
  OrientedCloud cloud;
  NeighborGraph graph;
  OrientationPatches patches;
  std::vector<SignedLink> links;
};

Scene Examine(const Eigen::Matrix3Xd& points) {
  const RunContext context;
  Scene scene;
  const PointIndex index(points);
  const SpatialFrame curve{Eigen::Vector3d::Zero(), 1e9};  // all points lie in one cell of it
  scene.graph = BuildNeighborGraph(index, points, NeighborOptions{}, context).value();
  scene.cloud = EstimateNormals(points, scene.graph, {}, curve, context).value().cloud;
  const std::vector<float> relations = EdgeSignVotes(scene.graph, scene.cloud, context).value();
  scene.patches = SurePatches(scene.graph, relations, RunContext{}).value();
  scene.links =
      LinksBetween(scene.patches, scene.graph, relations, scene.cloud, RunContext{}).value();
  return scene;
}

// `count` points on the unit square at height z, each off by Gaussian noise along z.
void AddSheet(int count, double z, double noise, std::mt19937* random, Eigen::Matrix3Xd* points) {
  std::uniform_real_distribution<double> side(0, 1);
  std::normal_distribution<double> off(0, 1);
  const int64_t first = points->cols();
  points->conservativeResize(3, first + count);
  for (int64_t i = first; i < points->cols(); ++i) {
    points->col(i) << side(*random), side(*random), z + noise * off(*random);
  }
}

// Votes between patches of the two sheets, against the sides that their normals are on. `middle`:
// the height between the sheets.
struct Votes {
  double same = 0, opposite = 0;  // of the true sides
};
Votes VotesAcross(const Scene& scene, double middle) {
  std::vector<double> height(static_cast<size_t>(scene.patches.count), 0.0);
  std::vector<double> up(height.size(), 0.0), size(height.size(), 0.0);
  for (size_t i = 0; i < scene.patches.patch.size(); ++i) {
    const int patch = scene.patches.patch[i];
    const auto point = static_cast<int64_t>(i);
    height[patch] += scene.cloud.points(2, point) - middle;
    up[patch] += (scene.patches.parity[i] != 0 ? -1 : 1) * scene.cloud.normals(2, point);
    size[patch] += 1;
  }
  Votes votes;
  for (const SignedLink& link : scene.links) {
    if (height[link.a] * height[link.b] > 0) continue;
    if (size[link.a] < 12 || size[link.b] < 12) continue;
    const double side = up[link.a] * up[link.b] > 0 ? 1 : -1;
    (link.weight * side > 0 ? votes.same : votes.opposite) += std::abs(link.weight);
  }
  return votes;
}

TEST(OrientationPatchesTest, APatchOfASmoothSheetHasOneSide) {
  std::mt19937 random(1);
  Eigen::Matrix3Xd points(3, 0);
  AddSheet(4000, 0, 0.001, &random, &points);
  const Scene scene = Examine(points);
  EXPECT_LE(scene.patches.count, 4000 / 12);
  std::vector<int> up(static_cast<size_t>(scene.patches.count), 0);
  for (size_t i = 0; i < scene.patches.patch.size(); ++i) {
    const bool is_up =
        (scene.cloud.normals(2, static_cast<int64_t>(i)) > 0) == (scene.patches.parity[i] == 0);
    int& seen = up[scene.patches.patch[i]];
    EXPECT_NE(seen, is_up ? -1 : 1);
    seen = is_up ? 1 : -1;
  }
}

// Two flat patches over each other or side by side at different heights, with edges from each point
// to the nearest of the other patch that all say 'same side'.
double VoteBetween(double height, double aside) {
  constexpr int kSide = 6, kNearest = 5;
  constexpr int kPoints = kSide * kSide;
  OrientedCloud cloud;
  cloud.points.resize(3, 2 * kPoints);
  cloud.normals = Eigen::Vector3d::UnitZ().replicate(1, 2 * kPoints);
  cloud.spacing.assign(2 * kPoints, 1.0f);
  cloud.noise.assign(2 * kPoints, 0.0f);
  OrientationPatches patches;
  patches.count = 2;
  patches.parity.assign(2 * kPoints, 0);
  NeighborGraph graph;
  graph.k = kNearest;
  for (int i = 0; i < 2 * kPoints; ++i) {
    const bool second = i >= kPoints;
    const int place = i % kPoints;
    cloud.points.col(i) << place % kSide + (second ? aside : 0), place / kSide,
        0.05 * (i % 2) + (second ? height : 0);
    patches.patch.push_back(second ? 1 : 0);
  }
  for (int i = 0; i < 2 * kPoints; ++i) {
    std::vector<int> others(kPoints);
    std::iota(others.begin(), others.end(), i < kPoints ? kPoints : 0);
    const auto distance = [&](int j) { return (cloud.points.col(j) - cloud.points.col(i)).norm(); };
    std::sort(others.begin(), others.end(),
              [&](int a, int b) { return distance(a) < distance(b); });
    graph.indices.insert(graph.indices.end(), others.begin(), others.begin() + kNearest);
  }
  double sum = 0;
  const std::vector<float> relations(graph.indices.size(), 1.0f);
  const auto links = LinksBetween(patches, graph, relations, cloud, RunContext{});
  for (const SignedLink& link : *links) {
    sum += link.weight;
  }
  return sum / static_cast<double>(relations.size());
}

TEST(OrientationPatchesTest, PatchesOverEachOtherAreOpposite) {
  EXPECT_NEAR(VoteBetween(1.2, 0), -0.8, 0.01);
  EXPECT_NEAR(VoteBetween(0.6, 1), -0.8, 0.01);
}

TEST(OrientationPatchesTest, PatchesSideBySideAndScansThatDoNotQuiteMeetAreAsTheirEdgesSay) {
  EXPECT_NEAR(VoteBetween(1.2, 6), 1, 1e-6);
  EXPECT_NEAR(VoteBetween(0.3, 0), 1, 1e-6);
}

// Two patches of points that are not neighbours, with one pair that faces each other.
double FacingVote(uint8_t parity_of_second) {
  constexpr int kPoints = 4;
  OrientedCloud cloud;
  cloud.points = Eigen::Matrix3Xd::Zero(3, 2 * kPoints);
  cloud.normals = Eigen::Vector3d::UnitZ().replicate(1, 2 * kPoints);
  cloud.spacing.assign(2 * kPoints, 1.0f);
  cloud.noise.assign(2 * kPoints, 0.0f);
  OrientationPatches patches;
  patches.count = 2;
  NeighborGraph graph;
  graph.k = 1;
  for (int i = 0; i < 2 * kPoints; ++i) {
    const bool second = i >= kPoints;
    cloud.points.col(i) << i % kPoints, 0, second ? 1.5 : 0;
    patches.patch.push_back(second ? 1 : 0);
    patches.parity.push_back(second ? parity_of_second : 0);
    graph.indices.push_back((second ? kPoints : 0) + (i + 1) % kPoints);
  }
  graph.facing = {{1, kPoints + 1}};
  const std::vector<float> relations(2 * kPoints, 1.0f);
  const auto links = LinksBetween(patches, graph, relations, cloud, RunContext{});
  EXPECT_EQ(links->size(), 1u);
  return links->empty() ? 0 : links->front().weight;
}

TEST(OrientationPatchesTest, PointsThatFaceEachOtherVoteOpposite) {
  EXPECT_LT(FacingVote(0), -1);
  EXPECT_GT(FacingVote(1), 1);
}

// Two floors that meet at a step are seen from the same side.
TEST(OrientationPatchesTest, AStepIsNoWall) {
  const double spacing = std::sqrt(4 / (M_PI * 4000));
  std::mt19937 random(3);
  Eigen::Matrix3Xd points(3, 0);
  AddSheet(4000, 0, 0, &random, &points);
  AddSheet(4000, 1.2 * spacing, 0, &random, &points);
  points.rightCols(4000).row(0).array() += 1;
  const Votes votes = VotesAcross(Examine(points), 0.6 * spacing);
  EXPECT_LT(votes.opposite, votes.same);
}

TEST(OrientationPatchesTest, PatchesHaveABoundedSize) {
  std::mt19937 random(4);
  Eigen::Matrix3Xd points(3, 0);
  AddSheet(3000, 0, 0, &random, &points);
  const Scene scene = Examine(points);
  std::vector<int> size(static_cast<size_t>(scene.patches.count), 0);
  for (const int patch : scene.patches.patch) ++size[patch];
  for (const int points_of_patch : size) EXPECT_LE(points_of_patch, 48);
}

}  // namespace
}  // namespace rilievo
