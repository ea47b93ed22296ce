#include "core/control/simplify/relax_mesh.h"

#include <gtest/gtest.h>

#include "core/control/simplify/simplify_mesh.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

TEST(RelaxTangentially, RoundsTheFacesAndStaysOnTheSphere) {
  SimplifyOptions options;
  options.target_faces = 1500;
  auto mesh = SimplifyMesh(MarchTetrahedra(SphereField, 40), options, RunContext());
  ASSERT_TRUE(mesh.ok());
  const double before = Mean(Roundnesses(*mesh));
  const Eigen::Matrix3Xi faces = mesh->faces;
  RelaxTangentially(&*mesh, 4);
  EXPECT_EQ(mesh->faces, faces);
  EXPECT_GT(Mean(Roundnesses(*mesh)), before + 0.02);
  EXPECT_LT(LargestField(*mesh, SphereField), 0.005);
}

TEST(RelaxTangentially, KeepsAPlaneFlatAndItsBorderStraight) {
  ControlMesh mesh = Sheet(20, 16, false, [](double s, double t) -> Vector3d {
    return {s + 0.02 * std::sin(40 * s * t), t + 0.01 * std::sin(60 * s) * t * (1 - t), 0};
  });
  RelaxTangentially(&mesh, 6);
  const double edge = 0.05;  // its corners are the only places where the border is bent
  EXPECT_LT(mesh.vertices.row(2).cwiseAbs().maxCoeff(), 1e-12);
  for (int c = 0; c < 20; ++c) {
    EXPECT_NEAR(mesh.vertices(1, c), 0, 0.02 * edge);
    EXPECT_NEAR(mesh.vertices(1, 15 * 20 + c), 1, 0.02 * edge);
  }
}

TEST(RelaxTangentially, SlidesAlongACreaseOnly) {
  ControlMesh mesh = Sheet(21, 21, false, [](double s, double t) -> Vector3d {
    const double shift = 0.012 * std::sin(50 * s + 30 * t);
    return {s + shift, t, -std::abs(t - 0.5)};
  });
  RelaxTangentially(&mesh, 6);
  const double edge = 0.05;
  for (int c = 0; c < 21; ++c) {
    EXPECT_NEAR(mesh.vertices(1, 10 * 21 + c), 0.5, 0.02 * edge);
    EXPECT_NEAR(mesh.vertices(2, 10 * 21 + c), 0.0, 0.04 * edge);
  }
}

}  // namespace
}  // namespace rilievo
