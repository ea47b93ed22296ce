#include "core/scan/orientation/edge_sign_votes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {
namespace {

// Two points with planes.
OrientedCloud TwoPoints(const Eigen::Vector3d& a, const Eigen::Vector3d& normal_a,
                        const Eigen::Vector3d& b, const Eigen::Vector3d& normal_b,
                        float noise = 0) {
  OrientedCloud cloud;
  cloud.points.resize(3, 2);
  cloud.points << a, b;
  cloud.normals.resize(3, 2);
  cloud.normals << normal_a.normalized(), normal_b.normalized();
  cloud.spacing = {1, 1};
  cloud.noise = {noise, noise};
  return cloud;
}

// On a circle any two normals belong together, however far they turn: exactly 1 while they are
// nearly parallel, sure of the side beyond.
TEST(SignVoteTest, OnAnArcTheSideIsCertain) {
  for (const double turn : {0.05, 0.3, 1.0, 2.0}) {
    const Eigen::Vector3d a(1, 0, 0), b(std::cos(turn), std::sin(turn), 0);
    const double relation = SignVote(TwoPoints(a, a, b, b), 0, 1);
    EXPECT_NEAR(relation, std::cos(turn) > 0.8 ? 1 : 0.5, 1e-6) << turn;
    EXPECT_NEAR(SignVote(TwoPoints(a, -a, b, b), 0, 1), -relation, 1e-12) << turn;
    EXPECT_NEAR(SignVote(TwoPoints(a, -a, b, -b), 0, 1), relation, 1e-12) << turn;
  }
}

TEST(SignVoteTest, AcrossARightAngledEdge) {
  // The edge of a box at the origin, the same distance from it on either side: an arc fits.
  EXPECT_NEAR(SignVote(TwoPoints({-1, 0, 0}, {0, 0, 1}, {0, 0, -1}, {1, 0, 0}), 0, 1), 0.5, 1e-6);
  // The concave edge of a step.
  EXPECT_NEAR(SignVote(TwoPoints({-1, 0, 0}, {0, 0, 1}, {0, 0, 1}, {-1, 0, 0}), 0, 1), 0.5, 1e-6);
  // Half as far on one side.
  EXPECT_GT(SignVote(TwoPoints({-1, 0, 0}, {0, 0, 1}, {0, 0, -0.5}, {1, 0, 0}), 0, 1), 0.4);
}

TEST(SignVoteTest, ParallelPlanesApartCannotTell) {
  const OrientedCloud wall = TwoPoints({0, 0, 0}, {0, 0, 1}, {0.2, 0, 1.5}, {0, 0, 1});
  EXPECT_EQ(SignVote(wall, 0, 1), 0);
  // So do the ends of an arc of nearly half a turn.
  const Eigen::Vector3d a(1, 0, 0), b(std::cos(3.0), std::sin(3.0), 0);
  EXPECT_EQ(SignVote(TwoPoints(a, a, b, b), 0, 1), 0);
  // With noise that explains the step they are one sheet.
  const OrientedCloud thick = TwoPoints({0, 0, 0}, {0, 0, 1}, {0.8, 0, 0.5}, {0, 0, 1}, 0.3f);
  EXPECT_GT(SignVote(thick, 0, 1), 0.5);
}

TEST(SignVoteTest, TheSamePlaceHasTheSideOfItsNormals) {
  const Eigen::Vector3d at(0.1, 0.2, 0.3), up(0, 0, 1);
  EXPECT_EQ(SignVote(TwoPoints(at, up, at, up), 0, 1), 1);
  EXPECT_EQ(SignVote(TwoPoints(at, up, at, -up), 0, 1), -1);
}

// True normals with random signs.
struct SignedScan {
  KnownCloud known;
  NeighborGraph graph;
  OrientedCloud cloud;
  // `area`: of the whole surface.
  SignedScan(KnownCloud shape, double area, double noise = 0) : known(std::move(shape)) {
    AddNoise(noise, 7, &known);
    const PointIndex index(known.cloud.points);
    graph = *BuildNeighborGraph(index, known.cloud.points, NeighborOptions(), RunContext());
    const auto count = known.cloud.points.cols();
    cloud.points = known.cloud.points;
    cloud.normals = known.normals;
    const double share = area / static_cast<double>(count);
    cloud.spacing.assign(count, static_cast<float>(std::sqrt(4 / std::numbers::pi * share)));
    cloud.noise.assign(count, static_cast<float>(noise));
    Random random(5);
    for (int64_t i = 0; i < count; ++i) {
      if (random.Uniform() < 0.5) cloud.normals.col(i) *= -1;
    }
  }
};

// Sums of the sizes of the relations, a mean edge; `wrong`: of those against the true sides.
struct Judgement {
  double said = 0, wrong = 0;
};
Judgement Judge(const SignedScan& scene) {
  const std::vector<float> relations = *EdgeSignVotes(scene.graph, scene.cloud, RunContext());
  const auto side = [&](int i) {
    return scene.cloud.normals.col(i).dot(scene.known.normals.col(i));
  };
  Judgement judgement;
  for (size_t edge = 0; edge < relations.size(); ++edge) {
    EXPECT_LE(std::abs(relations[edge]), 1);
    const double share = std::abs(relations[edge]) / static_cast<double>(relations.size());
    const int a = static_cast<int>(edge) / scene.graph.k, b = scene.graph.indices[edge];
    judgement.said += share;
    judgement.wrong += side(a) * side(b) * relations[edge] < 0 ? share : 0;
  }
  return judgement;
}

TEST(EdgeSignVotesTest, SmoothSurfacesAreToldWithoutMistakes) {
  const double torus_area = 4 * std::numbers::pi * std::numbers::pi * 0.35;
  for (const SignedScan& scene : {SignedScan(SphereCloud(4000, 1), 4 * std::numbers::pi),
                                  SignedScan(TorusCloud(8000, 2), torus_area)}) {
    EXPECT_GT(Judge(scene).said, 0.9);
    EXPECT_EQ(Judge(scene).wrong, 0);
  }
}

// A quarter of the spacing is the noise of a poor scanner.
TEST(EdgeSignVotesTest, NoiseIsNoStep) {
  const Judgement judgement = Judge(SignedScan(SphereCloud(4000, 1), 4 * std::numbers::pi, 0.015));
  EXPECT_GT(judgement.said, 0.5);
  EXPECT_LT(judgement.wrong, 0.001);
}

// Of a plate, about two in five edges run to the other face.
TEST(EdgeSignVotesTest, TheFacesOfAThinPlateAreToldByTheirSurroundings) {
  constexpr int kPoints = 12000;
  const double spacing = std::sqrt(4 / std::numbers::pi * 2 / kPoints);
  for (const double thickness : {0.6, 1.2, 1.8}) {
    const Judgement judgement =
        Judge(SignedScan(BoxCloud(kPoints, 3, {1, 1, thickness * spacing}), 2));
    EXPECT_GT(judgement.said, 0.7) << thickness;
    EXPECT_LT(judgement.wrong, 0.03) << thickness;
  }
}

TEST(EdgeSignVotesTest, NoThreadChangesABit) {
  const SignedScan scene(BoxCloud(4000, 4, {1, 0.7, 0.1}), 1.74);
  RunContext one, three;
  one.threads = 1;
  three.threads = 3;
  EXPECT_EQ(*EdgeSignVotes(scene.graph, scene.cloud, one),
            *EdgeSignVotes(scene.graph, scene.cloud, three));
}

}  // namespace
}  // namespace rilievo
