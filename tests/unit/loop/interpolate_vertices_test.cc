#include "core/loop/interpolate_vertices.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/loop/limit_stencils.h"
#include "tests/unit/loop/loop_meshes.h"

namespace rilievo::testing {
namespace {

using ::testing::HasSubstr;

InterpolatedMesh Interpolated(const ControlMesh& mesh, const InterpolationOptions& options = {}) {
  auto made = InterpolateVertices(mesh, options, RunContext());
  EXPECT_TRUE(made.ok()) << made.status();
  return *std::move(made);
}

Eigen::Matrix3Xd LimitsOf(const ControlMesh& mesh, int level) {
  const LoopRefinement refinement = Refine(mesh, level);
  return EvaluateLimit(refinement, mesh.vertices, level, RunContext())->positions;
}

double LargestMiss(const ControlMesh& given, const InterpolatedMesh& made) {
  return (LimitsOf(made.mesh, 0).leftCols(given.vertices.cols()) - given.vertices)
      .colwise()
      .norm()
      .maxCoeff();
}

// The surface over the given faces alone: all of its control points follow from the vertices.
ControlMesh SolvedExactly(const ControlMesh& mesh) {
  const auto stencils = BuildLimitStencils(Refine(mesh, 0), 0, RunContext());
  const Eigen::Index count = mesh.vertices.cols();
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(count, count);
  for (int v = 0; v < count; ++v) {
    const auto s = static_cast<size_t>(v);
    for (int i = stencils->begin[s]; i < stencils->begin[s + 1]; ++i) {
      weights(v, stencils->control_vertices[static_cast<size_t>(i)]) =
          stencils->position[static_cast<size_t>(i)];
    }
  }
  ControlMesh solved = mesh;
  solved.vertices = weights.partialPivLu().solve(mesh.vertices.transpose()).transpose();
  return solved;
}

// Squared umbrella vectors of the limit positions of a level, of smooth closed meshes.
double BendingOf(const ControlMesh& mesh, int level) {
  const LoopRefinement refinement = Refine(mesh, level);
  const Eigen::Matrix3Xd points =
      EvaluateLimit(refinement, mesh.vertices, level, RunContext())->positions;
  const VertexRings rings = BuildVertexRings(refinement.levels.back());
  double sum = 0;
  for (Eigen::Index v = 0; v < points.cols(); ++v) {
    const auto s = static_cast<size_t>(v);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    const int begin = rings.neighbor_begin[s], end = rings.neighbor_begin[s + 1];
    for (int i = begin; i < end; ++i) mean += points.col(rings.neighbors[static_cast<size_t>(i)]);
    sum += (mean / (end - begin) - points.col(v)).squaredNorm();
  }
  return sum;
}

TEST(InterpolateVerticesTest, SurfacePassesThroughAllVertices) {
  for (const NamedMesh& named : LoopMeshes()) {
    const InterpolatedMesh made = Interpolated(named.mesh);
    EXPECT_LE(made.steps, 60);
    EXPECT_LT(LargestMiss(named.mesh, made), 1e-13) << named;
    EXPECT_EQ(made.mesh.faces.cols(), 4 * named.mesh.faces.cols());
    // After any number of steps.
    EXPECT_LT(LargestMiss(named.mesh, Interpolated(named.mesh, {.most_steps = 0})), 1e-13) << named;
  }
}

TEST(InterpolateVerticesTest, AnyValenceInsideAndOnTheBorder) {
  Random random(2);
  for (int valence = 3; valence <= 64; ++valence) {
    for (const ControlMesh& mesh : {Bipyramid(valence), HalfFan(valence)}) {
      const ControlMesh bent = Perturbed(mesh, 0.05, random);
      EXPECT_LT(LargestMiss(bent, Interpolated(bent)), 1e-13) << valence;
    }
  }
}

TEST(InterpolateVerticesTest, BendsNoMoreThanTheSurfaceOverTheGivenFaces) {
  for (const NamedMesh& named : LoopMeshes()) {
    if (SummarizeTopology(named.mesh.faces, static_cast<int>(named.mesh.vertices.cols()))
            .boundary_loops > 0) {
      continue;
    }
    const double bending = BendingOf(Interpolated(named.mesh).mesh, 2);
    EXPECT_LT(bending, 1.1 * BendingOf(SolvedExactly(named.mesh), 3)) << named;
  }
}

TEST(InterpolateVerticesTest, TheIcosahedronBecomesASphereNearly) {
  const Eigen::Matrix3Xd points = LimitsOf(Interpolated(Icosahedron()).mesh, 3);
  EXPECT_NEAR(points.colwise().norm().maxCoeff(), 1, 0.03);
  EXPECT_NEAR(points.colwise().norm().minCoeff(), 1, 0.03);
}

TEST(InterpolateVerticesTest, AFlatSheetStaysFlatAndALineStraight) {
  const Eigen::Matrix3Xd points = LimitsOf(Interpolated(Grid(5, 5)).mesh, 2);
  EXPECT_LT(points.row(2).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT(std::abs(points.row(0).minCoeff()), 0.03);
}

TEST(InterpolateVerticesTest, CreasesAndCornersStay) {
  ControlMesh cube = Box({0, 0, 0}, {1, 1, 1});
  for (int a = 0; a < 8; ++a) {
    cube.corners.push_back(a);
    for (const int b : {a | 1, a | 2, a | 4}) {
      if (b > a) cube.creases.push_back({a, b, a == 0 ? 2.5f : kInfiniteSharpness});
    }
  }
  const InterpolatedMesh made = Interpolated(cube);
  EXPECT_EQ(made.mesh.creases.size(), 24);
  EXPECT_EQ(made.mesh.corners, cube.corners);
  EXPECT_EQ(made.mesh.creases[0].sharpness, 1.5f);
  EXPECT_LT(LargestMiss(cube, made), 1e-15);
}

TEST(InterpolateVerticesTest, FollowsSimilarities) {
  Random random(4);
  const ControlMesh mesh = Perturbed(Icosahedron(), 0.1, random);
  ControlMesh moved = mesh;
  const Eigen::Affine3d motion = Eigen::Translation3d(1e3, -2e3, 5e2) *
                                 Eigen::AngleAxisd(1, Eigen::Vector3d(1, 2, 2).normalized()) *
                                 Eigen::Scaling(7.0);
  moved.vertices = motion * mesh.vertices;
  EXPECT_LT((motion * Interpolated(mesh).mesh.vertices - Interpolated(moved).mesh.vertices).norm(),
            1e-7);
  EXPECT_LT(LargestMiss(moved, Interpolated(moved)), 1e-11);
}

TEST(InterpolateVerticesTest, WhatCannotBeInterpolatedIsRefused) {
  ControlMesh mesh = Icosahedron();
  EXPECT_THAT(
      std::string(InterpolateVertices(mesh, {.most_steps = 1001}, RunContext()).status().message()),
      HasSubstr("[0, 1000]"));
  EXPECT_FALSE(InterpolateVertices(mesh, {.tolerance = 1}, RunContext()).ok());
  mesh.vertices(1, 3) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(std::string(InterpolateVertices(mesh, {}, RunContext()).status().message()),
              HasSubstr("not finite"));
  mesh = Icosahedron();
  mesh.faces.col(0) = mesh.faces.col(1);
  EXPECT_FALSE(InterpolateVertices(mesh, {}, RunContext()).ok());
}

}  // namespace
}  // namespace rilievo::testing
