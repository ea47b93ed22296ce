#include "core/surface/signed_distance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "tests/unit/loop/crease_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

std::vector<double> Distances(const ControlMesh& mesh, const Eigen::Matrix3Xd& places) {
  const auto field = SignedDistance::Build({mesh.vertices, mesh.faces, {}}, 1, RunContext());
  EXPECT_TRUE(field.ok()) << field.status();
  const auto distances = field->Of(places, RunContext());
  EXPECT_TRUE(distances.ok()) << distances.status();
  return *distances;
}

// The nearest points of many of these places are corners and edges.
TEST(SignedDistanceTest, OfACubeIsExact) {
  testing::Random random(41);
  Eigen::Matrix3Xd places(3, 4000);
  for (Eigen::Index i = 0; i < places.cols(); ++i) places.col(i) = 2 * random.Vector();
  const std::vector<double> distances = Distances(testing::SharpCube(), places);
  for (Eigen::Index i = 0; i < places.cols(); ++i) {
    const Vector3d beyond = places.col(i).cwiseAbs() - Vector3d::Ones();
    const double expected =
        beyond.maxCoeff() <= 0 ? beyond.maxCoeff() : beyond.cwiseMax(0.0).norm();
    EXPECT_NEAR(distances[static_cast<size_t>(i)], expected, 1e-12) << places.col(i).transpose();
  }
}

// A spike so thin that a single triangle's normal at its tip tells the wrong side.
TEST(SignedDistanceTest, TellsTheSideAtASharpVertex) {
  ControlMesh spike = testing::Bipyramid(5);
  spike.vertices.row(2) *= 20;
  const Eigen::Matrix3Xd places =
      (Eigen::Matrix3Xd(3, 3) << 0, 0.3, 0, 0, 0, -0.2, 21, 20.5, 19).finished();
  const std::vector<double> distances = Distances(spike, places);
  EXPECT_NEAR(distances[0], 1, 1e-12);
  EXPECT_GT(distances[1], 0);
  EXPECT_GT(distances[2], 0);
}

TEST(SignedDistanceTest, OfASheetIsPositiveAboveIt) {
  const Eigen::Matrix3Xd places =
      (Eigen::Matrix3Xd(3, 3) << 0.5, 0.2, std::nan(""), 0.4, 0.7, 0, 2, -3, 0).finished();
  const std::vector<double> distances = Distances(testing::Grid(4, 4), places);
  EXPECT_NEAR(distances[0], 2, 1e-12);
  EXPECT_NEAR(distances[1], -3, 1e-12);
  EXPECT_TRUE(std::isnan(distances[2]));
}

Vector3d NormalOf(const ControlMesh& mesh, Eigen::Index face) {
  const auto corner = [&](int k) -> Vector3d { return mesh.vertices.col(mesh.faces(k, face)); };
  return (corner(1) - corner(0)).cross(corner(2) - corner(0));
}

// A ray leaves a closed mesh as often as it enters it, in turn.
TEST(RayTest, EntersAndLeavesInTurn) {
  testing::Random random(42);
  const ControlMesh torus = testing::Torus(12, 8);
  const auto tree = ClosestPointTree::Build(torus.vertices, torus.faces, RunContext());
  ASSERT_TRUE(tree.ok()) << tree.status();
  int met = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vector3d from = 3 * random.Vector().normalized(), to = random.Vector();
    bool inside = false;
    for (const ClosestPointTree::RayHit& hit : tree->AlongRay(from, to - from)) {
      const auto face = torus.faces.col(hit.triangle);
      const Vector3d on_triangle = hit.weights[0] * torus.vertices.col(face[0]) +
                                   hit.weights[1] * torus.vertices.col(face[1]) +
                                   hit.weights[2] * torus.vertices.col(face[2]);
      EXPECT_LT((from + hit.at * (to - from) - on_triangle).norm(), 1e-12);
      EXPECT_EQ(hit.from_behind, inside);
      inside = !inside;
      ++met;
    }
    EXPECT_FALSE(inside);
  }
  EXPECT_GT(met, 1000);
}

// No ray slips through an edge or a vertex, and none meets the surface twice there, unless it
// touches the outline.
TEST(RayTest, MeetsEdgesAndVerticesOnce) {
  testing::Random random(43);
  const ControlMesh torus = testing::Torus(12, 8);
  const auto tree = ClosestPointTree::Build(torus.vertices, torus.faces, RunContext());
  ASSERT_TRUE(tree.ok()) << tree.status();
  int tried = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vector3d from = 3 * random.Vector().normalized();
    const auto aimed = torus.faces.col(random.Below(static_cast<int>(torus.faces.cols())));
    const int a = aimed[0], b = i % 2 == 0 ? a : aimed[1];
    const Vector3d to = (torus.vertices.col(a) + torus.vertices.col(b)) / 2;
    int toward = 0, away = 0;
    for (Eigen::Index f = 0; f < torus.faces.cols(); ++f) {
      const auto face = torus.faces.col(f);
      if ((face.array() != a).all() || (face.array() != b).all()) continue;
      const double along = NormalOf(torus, f).dot(to - from);
      toward += along < 1e-9;
      away += along > -1e-9;
    }
    if (toward > 0 && away > 0) continue;  // the outline
    ++tried;
    int there = 0;
    for (const ClosestPointTree::RayHit& hit : tree->AlongRay(from, to - from)) {
      there += std::abs(hit.at - 1) < 1e-9;
    }
    EXPECT_EQ(there, 1) << i;
  }
  EXPECT_GT(tried, 1000);
}

TEST(RayTest, MeetsACubeWhereItShould) {
  const ControlMesh cube = testing::SharpCube();
  const auto tree = ClosestPointTree::Build(cube.vertices, cube.faces, RunContext());
  ASSERT_TRUE(tree.ok()) << tree.status();
  // Along an axis, through the diagonals of both squares: each is told once.
  const auto hits = tree->AlongRay({-3, 0, 0}, {2, 0, 0});
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_DOUBLE_EQ(hits[0].at, 1);
  EXPECT_DOUBLE_EQ(hits[1].at, 2);
  EXPECT_FALSE(hits[0].from_behind);
  EXPECT_TRUE(hits[1].from_behind);
  EXPECT_EQ(tree->AlongRay({0, 0, 0}, {0, 1, 0.3}).size(), 1u);
  EXPECT_TRUE(tree->AlongRay({-3, 2, 0}, {1, 0, 0}).empty());
  EXPECT_TRUE(tree->AlongRay({3, 0, 0}, {1, 0, 0}).empty());
  EXPECT_TRUE(tree->AlongRay({0, 0, 0}, {0, 0, 0}).empty());
}

}  // namespace
}  // namespace rilievo
