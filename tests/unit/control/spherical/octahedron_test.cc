#include "core/control/spherical/octahedron.h"

#include <gtest/gtest.h>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

TEST(Octahedron, HasTheCountsOfTheSeed) {
  for (int levels = 0; levels <= 5; ++levels) {
    const Octahedron octahedron(levels);
    const int power = 1 << (2 * levels);
    EXPECT_EQ(octahedron.directions().cols(), 4 * power + 2);
    EXPECT_EQ(octahedron.faces().cols(), 8 * power);
    const TopologySummary summary =
        SummarizeTopology(octahedron.faces(), static_cast<int>(octahedron.directions().cols()));
    EXPECT_TRUE(summary.manifold());
    EXPECT_TRUE(summary.oriented);
    EXPECT_EQ(summary.euler, 2);
  }
  EXPECT_EQ(Octahedron(5).directions().cols(), 4098);
}

TEST(Octahedron, FacesLookOutwardAndDifferLittleInArea) {
  const Octahedron octahedron(4);
  double least = 1e9, most = 0;
  for (const auto& face : octahedron.faces().colwise()) {
    const Vector3d a = octahedron.directions().col(face[0]);
    const Vector3d b = octahedron.directions().col(face[1]);
    const Vector3d c = octahedron.directions().col(face[2]);
    EXPECT_NEAR(a.norm(), 1, 1e-12);
    const double area = (b - a).cross(c - a).dot((a + b + c).normalized()) / 2;
    least = std::min(least, area);
    most = std::max(most, area);
  }
  EXPECT_GT(least, 0);
  EXPECT_LT(most / least, 2.2);
}

TEST(Octahedron, FindsTheFaceARayPierces) {
  const Octahedron octahedron(3);
  const Eigen::Matrix3Xd rays = SphereDirections(2000);
  for (int i = 0; i < rays.cols(); ++i) {
    const Vector3d direction = rays.col(i);
    const Eigen::Vector3i face = octahedron.faces().col(octahedron.FaceOf(3.7 * direction));
    const Vector3d a = octahedron.directions().col(face[0]);
    const Vector3d b = octahedron.directions().col(face[1]);
    const Vector3d c = octahedron.directions().col(face[2]);
    EXPECT_GE(direction.dot(a.cross(b)), -1e-12);
    EXPECT_GE(direction.dot(b.cross(c)), -1e-12);
    EXPECT_GE(direction.dot(c.cross(a)), -1e-12);
  }
}

}  // namespace
}  // namespace rilievo
