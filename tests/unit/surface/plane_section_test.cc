#include "core/surface/plane_section.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/unit/loop/crease_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

PlaneSection Cut(const ControlMesh& mesh, const Vector3d& normal, double offset) {
  const auto section = CutByPlane({mesh.vertices, mesh.faces, {}}, normal, offset);
  EXPECT_TRUE(section.ok()) << section.status();
  return *section;
}

// Its symmetry plane cuts a torus in two circles, the inner one a hole.
TEST(PlaneSectionTest, CutsATorusInCircles) {
  const ControlMesh torus = testing::Torus(1200, 501);
  const PlaneSection section = Cut(torus, {0, 0, 2}, 0.0002);
  ASSERT_EQ(section.polylines.size(), 2u);
  for (const SectionPolyline& polyline : section.polylines) {
    EXPECT_TRUE(polyline.closed);
    const double radius = polyline.points.col(0).head<2>().norm();
    EXPECT_LT(std::min(std::abs(radius - 1.4), std::abs(radius - 0.6)), 1e-4);
    for (Eigen::Index i = 0; i < polyline.points.cols(); ++i) {
      EXPECT_NEAR(polyline.points.col(i).head<2>().norm(), radius, 1e-4);
      EXPECT_NEAR(polyline.points(2, i), 0.0001, 1e-12);
    }
  }
  EXPECT_NEAR(section.length / (2 * std::numbers::pi * 2), 1, 1e-4);
  EXPECT_NEAR(section.area / (std::numbers::pi * (1.4 * 1.4 - 0.6 * 0.6)), 1, 1e-4);
}

// A plane through its axis, and one that touches it from inside (Villarceau): circles of the tube
// and of the ring.
TEST(PlaneSectionTest, CutsATorusAcross) {
  const ControlMesh torus = testing::Torus(1200, 500);
  const PlaneSection across = Cut(torus, {0.3, 1, 0}, 0);
  ASSERT_EQ(across.polylines.size(), 2u);
  EXPECT_NEAR(across.area / (2 * std::numbers::pi * 0.16), 1, 1e-4);
  const double slope = std::asin(0.4);
  const PlaneSection slanted = Cut(torus, {std::sin(slope), 0, std::cos(slope)}, 0);
  EXPECT_NEAR(slanted.length / (2 * 2 * std::numbers::pi), 1, 1e-3);
}

TEST(PlaneSectionTest, RunsWithTheInsideOnTheLeft) {
  const ControlMesh cube = testing::SharpCube();
  for (const Vector3d& normal : {Vector3d(0, 0, 1), Vector3d(0, 0, -1), Vector3d(0, 1, 0)}) {
    const PlaneSection section = Cut(cube, normal, 0.25);
    ASSERT_EQ(section.polylines.size(), 1u);
    EXPECT_NEAR(section.area, 4, 1e-12);
    EXPECT_NEAR(section.length, 8, 1e-12);
  }
}

// Through corners and along edges: a vertex in the plane counts as above it.
TEST(PlaneSectionTest, TakesVerticesInThePlane) {
  const PlaneSection diagonal = Cut(testing::SharpCube(), {1, 1, 0}, 0);
  EXPECT_NEAR(diagonal.area, 2 * 2 * std::sqrt(2), 1e-12);
  for (const SectionPolyline& polyline : diagonal.polylines) EXPECT_TRUE(polyline.closed);
  // The top face lies in the plane: its border is the cut, seen from just below.
  EXPECT_NEAR(Cut(testing::SharpCube(), {0, 0, 1}, 1).area, 4, 1e-12);
  EXPECT_TRUE(Cut(testing::SharpCube(), {0, 0, 1}, -1).polylines.empty());
  EXPECT_TRUE(Cut(testing::SharpCube(), {0, 0, 1}, 3).polylines.empty());
}

TEST(PlaneSectionTest, OfAnOpenSheetIsOpen) {
  const PlaneSection section = Cut(testing::Grid(9, 9), {1, 0.2, 0}, 0.51);
  ASSERT_EQ(section.polylines.size(), 1u);
  EXPECT_FALSE(section.polylines[0].closed);
  EXPECT_NEAR(section.length, std::sqrt(1 + 0.04), 1e-12);
  EXPECT_EQ(section.area, 0);
}

TEST(PlaneSectionTest, AxesAreRightHanded) {
  for (const Vector3d& normal :
       {Vector3d(0, 0, 1), Vector3d(0, 0, -1), Vector3d(1, 0, 0), Vector3d(0.6, 0.48, 0.64)}) {
    const PlaneAxes axes = AxesOf({normal, 0});
    EXPECT_NEAR(axes.right.cross(axes.up).dot(normal), 1, 1e-12);
  }
  EXPECT_EQ(AxesOf({Vector3d::UnitZ(), 0}).right, Vector3d::UnitX());
  EXPECT_EQ(AxesOf({-Vector3d::UnitY(), 0}).up, Vector3d::UnitZ());
}

TEST(PlaneSectionTest, RefusesAPlaneWithoutANormal) {
  const ControlMesh cube = testing::SharpCube();
  const TriangleMesh mesh = {cube.vertices, cube.faces, {}};
  EXPECT_EQ(CutByPlane(mesh, Vector3d::Zero(), 1).status().code(),
            absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(
      CutByPlane(mesh, Vector3d::UnitX(), std::numeric_limits<double>::infinity()).status().code(),
      absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
