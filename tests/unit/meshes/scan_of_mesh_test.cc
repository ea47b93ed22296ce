#include "core/meshes/scan_of_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

CheckedMesh Checked(const ControlMesh& mesh) {
  return CheckMesh({mesh.vertices, {}, mesh.faces}, RunContext{}).value();
}

ScanSurface ScanOf(const CheckedMesh& mesh, const std::vector<Rgb>& colors = {}) {
  return ScanOfMesh(mesh, colors, FewestPointsOnMesh(mesh.triangles.cols()), RunContext{}).value();
}

// That an arc from a point to the next has in the mean where this is the total curvature.
double SagittaOf(double curvature, int points) {
  return curvature / (2 * std::numbers::pi * points);
}

TEST(PointsOnMeshTest, AreMoreWhereTheSurfaceTurnsMore) {
  const CheckedMesh mesh = Checked(testing::Icosahedron());
  const auto corners = mesh.vertices(Eigen::all, mesh.triangles.col(0)).eval();
  const double edge = (corners.col(1) - corners.col(0)).norm();
  const double sagitta = SagittaOf(30 * edge * std::acos(std::sqrt(5) / 3), 150'000);
  EXPECT_NEAR(static_cast<double>(PointsOnMesh(mesh, sagitta)), 150'000, 2);
  EXPECT_EQ(PointsOnMesh(mesh, 2 * sagitta), 100'000);
  EXPECT_EQ(PointsOnMesh(mesh, sagitta / 2), 250'000);
}

TEST(PointsOnMeshTest, AtABorderTheSurfaceTurnsBack) {
  const CheckedMesh mesh = Checked(testing::Grid(4, 4));
  const Eigen::Vector3d sides =
      mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
  const double sagitta = SagittaOf(std::numbers::pi * 2 * sides.sum(), 150'000);
  EXPECT_NEAR(static_cast<double>(PointsOnMesh(mesh, sagitta)), 150'000, 2);
}

TEST(PointsOnMeshTest, AreOneForEachTriangleAtLeast) {
  EXPECT_EQ(FewestPointsOnMesh(1), 100'000);
  EXPECT_EQ(FewestPointsOnMesh(200'000), 200'000);
  EXPECT_EQ(FewestPointsOnMesh(1'000'000), 250'000);
}

TEST(ScanOfMeshTest, PointsLieEvenlyOnTheTriangles) {
  const CheckedMesh mesh = Checked(testing::Icosahedron());
  const ScanSurface scan = ScanOf(mesh);
  const OrientedCloud& cloud = scan.cloud;
  EXPECT_NEAR(static_cast<double>(cloud.points.cols()), 100'000, 1);
  EXPECT_EQ(scan.figures.kept, cloud.points.cols());
  // Of a regular icosahedron each point lies on the nearest face plane, whose normal it has.
  double share = 0;
  const double inner = mesh.vertices(Eigen::all, mesh.triangles.col(0)).rowwise().mean().norm();
  for (Eigen::Index i = 0; i < cloud.points.cols(); ++i) {
    EXPECT_NEAR(cloud.points.col(i).dot(cloud.normals.col(i)), inner, 1e-6);
    share += std::numbers::pi / 4 * cloud.spacing[i] * cloud.spacing[i];
  }
  double area = 0;
  for (const auto face : mesh.triangles.colwise()) {
    area += (mesh.vertices.col(face[1]) - mesh.vertices.col(face[0]))
                .cross(mesh.vertices.col(face[2]) - mesh.vertices.col(face[0]))
                .norm() /
            2;
  }
  EXPECT_NEAR(share, area, 1e-3 * area);
  // No hole: whatever place of a face is asked for has a point within a spacing.
  testing::Random random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    const auto corners = mesh.vertices(Eigen::all, mesh.triangles.col(random.Below(20))).eval();
    Eigen::Vector3d weights = random.Vector().cwiseAbs();
    const Eigen::Vector3d place = corners * (weights / weights.sum());
    int nearest;
    double squared;
    scan.index.Nearest(place, 1, &nearest, &squared);
    EXPECT_LT(std::sqrt(squared), 1.5 * cloud.median_spacing);
  }
}

TEST(ScanOfMeshTest, BordersHavePointsOfTheirOwn) {
  const CheckedMesh mesh = Checked(testing::Grid(4, 4));
  const ScanSurface scan = ScanOf(mesh);
  const Eigen::Vector3d low = mesh.vertices.rowwise().minCoeff();
  const auto on_border = (scan.cloud.points.row(0).array() - low[0]).abs() < 1e-12;
  const double length = mesh.vertices.row(1).maxCoeff() - low[1];
  EXPECT_NEAR(static_cast<double>(on_border.count()), length / scan.cloud.median_spacing, 2);
}

// Triangles that do not touch: all of their sides are borders.
TEST(ScanOfMeshTest, BordersCountAmongTheMost) {
  constexpr int kTriangles = 5000;
  ControlMesh mesh;
  mesh.vertices.resize(3, 3 * kTriangles);
  mesh.faces.resize(3, kTriangles);
  for (int t = 0; t < kTriangles; ++t) {
    const Eigen::Vector3d corner(t % 100, t / 100, 0);
    mesh.vertices.col(3 * t) = corner;
    mesh.vertices.col(3 * t + 1) = corner + 0.8 * Eigen::Vector3d::UnitX();
    mesh.vertices.col(3 * t + 2) = corner + 0.8 * Eigen::Vector3d::UnitY();
    mesh.faces.col(t) << 3 * t, 3 * t + 1, 3 * t + 2;
  }
  const auto count = [&](int64_t wanted) {
    const auto scan = ScanOfMesh(Checked(mesh), {}, wanted, RunContext{});
    return static_cast<double>(scan->cloud.points.cols());
  };
  EXPECT_GT(count(100'000), 150'000);
  EXPECT_NEAR(count(kMostPointsOnMesh), kMostPointsOnMesh, 0.02 * kMostPointsOnMesh);
}

TEST(ScanOfMeshTest, ASmallPieceHasPointsToo) {
  ControlMesh small = testing::Icosahedron();
  small.vertices *= 1e-4;
  small.vertices.row(0).array() += 3;
  const CheckedMesh mesh = Checked(testing::Union(testing::Icosahedron(), small));
  const ScanSurface scan = ScanOf(mesh);
  const double edge = mesh.vertices.row(0).maxCoeff() - 0.01;
  const auto there = scan.cloud.points.row(0).array() > edge;
  EXPECT_NEAR(static_cast<double>(there.count()), 100, 2);
  for (Eigen::Index i = 0; i < there.size(); ++i) {
    if (there[i]) {
      EXPECT_LT(scan.cloud.spacing[i], 1e-4);
    }
  }
}

TEST(ScanOfMeshTest, ColoursAreMixed) {
  const CheckedMesh mesh = Checked(testing::Tetrahedron());
  const std::vector<Rgb> colors = {{0, 0, 0}, {200, 0, 0}, {0, 200, 0}, {0, 0, 200}};
  const ScanSurface scan = ScanOf(mesh, colors);
  ASSERT_EQ(scan.colors.size(), static_cast<size_t>(scan.cloud.points.cols()));
  // Linear over the tetrahedron: the weight of a vertex is its channel.
  for (Eigen::Index i = 0; i < scan.cloud.points.cols(); i += 100) {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    double rest = 1;
    for (int k = 0; k < 3; ++k) {
      const double weight = scan.colors[i][k] / 200.0;
      place += weight * mesh.vertices.col(k + 1);
      rest -= weight;
    }
    place += rest * mesh.vertices.col(0);
    EXPECT_LT((place - scan.cloud.points.col(i)).norm(), 0.01);
  }
}

}  // namespace
}  // namespace rilievo
