#include "core/surface/mass_properties.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/unit/loop/crease_meshes.h"

namespace rilievo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

MassProperties Of(const ControlMesh& mesh) {
  const auto properties = MassPropertiesOf(mesh.vertices, mesh.faces);
  EXPECT_TRUE(properties.ok()) << properties.status();
  return *properties;
}

TEST(MassPropertiesTest, OfACubeAnywhere) {
  ControlMesh cube = testing::SharpCube();
  const Vector3d center(500000, 4600000, -30);
  cube.vertices.colwise() += center;
  const MassProperties properties = Of(cube);
  EXPECT_TRUE(properties.closed);
  EXPECT_NEAR(properties.area, 24, 1e-12);
  EXPECT_NEAR(properties.volume, 8, 1e-12);
  EXPECT_LT((properties.centroid - center).norm(), 1e-9);
  // m (a^2 + b^2) / 12 about each axis.
  EXPECT_LT((properties.inertia - 8.0 * 8 / 12 * Matrix3d::Identity()).norm(), 1e-12);
}

TEST(MassPropertiesTest, OfATorus) {
  const MassProperties properties = Of(testing::Torus(1500, 600));
  constexpr double kRing = 1, kTube = 0.4;
  EXPECT_NEAR(properties.area / (4 * std::numbers::pi * std::numbers::pi * kRing * kTube), 1, 2e-5);
  const double volume = 2 * std::numbers::pi * std::numbers::pi * kRing * kTube * kTube;
  EXPECT_NEAR(properties.volume / volume, 1, 3e-5);
  EXPECT_LT(properties.centroid.norm(), 1e-12);
  const double axial = volume * (kRing * kRing + 0.75 * kTube * kTube);
  const double across = volume * (0.5 * kRing * kRing + 0.625 * kTube * kTube);
  EXPECT_NEAR(properties.inertia(2, 2) / axial, 1, 5e-5);
  EXPECT_NEAR(properties.inertia(0, 0) / across, 1, 5e-5);
  EXPECT_LT(std::abs(properties.inertia(0, 1)), 1e-12);
}

TEST(MassPropertiesTest, InsideOutHasANegativeVolume) {
  ControlMesh cube = testing::SharpCube();
  cube.faces.row(1).swap(cube.faces.row(2));
  EXPECT_NEAR(Of(cube).volume, -8, 1e-12);
  EXPECT_LT(Of(cube).centroid.norm(), 1e-12);
}

TEST(MassPropertiesTest, OfAnOpenSheet) {
  const MassProperties properties = Of(testing::Grid(5, 4));
  EXPECT_FALSE(properties.closed);
  EXPECT_NEAR(properties.area, 1, 1e-12);
  EXPECT_EQ(properties.volume, 0);
  EXPECT_LT((properties.centroid - Vector3d(0.5, 0.5, 0)).norm(), 1e-12);
  EXPECT_LT((properties.inertia.diagonal() - Vector3d(1, 1, 2) / 12).norm(), 1e-12);
}

TEST(MassPropertiesTest, RefusesPointsAndWhatIsNotFinite) {
  ControlMesh cube = testing::SharpCube();
  EXPECT_EQ(MassPropertiesOf(cube.vertices, Eigen::Matrix3Xi(3, 0)).status().code(),
            absl::StatusCode::kInvalidArgument);
  cube.vertices(1, 3) = std::nan("");
  EXPECT_EQ(MassPropertiesOf(cube.vertices, cube.faces).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
