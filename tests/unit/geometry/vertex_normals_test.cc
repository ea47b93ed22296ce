#include "core/geometry/vertex_normals.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

TEST(VertexNormalsTest, PlatonicSolidsPointOutward) {
  for (const ControlMesh& mesh :
       {testing::Tetrahedron(), testing::Bipyramid(4), testing::Icosahedron()}) {
    const Eigen::Matrix3Xd normals = VertexNormals(mesh.vertices, mesh.faces);
    EXPECT_LT((normals - mesh.vertices.colwise().normalized()).cwiseAbs().maxCoeff(), 1e-14);
  }
}

TEST(VertexNormalsTest, LargerFacesCountMore) {
  // Two right triangles along the x axis: one flat of area 1, one upright of area 2.
  Eigen::Matrix3Xd vertices(3, 4);
  vertices << 0, 1, 0, 0,  //
      0, 0, 2, 0,          //
      0, 0, 0, -4;
  const Eigen::Matrix3Xd normals = VertexNormals(vertices, testing::Faces({{0, 1, 2}, {1, 0, 3}}));
  EXPECT_LT((normals.col(0) - Eigen::Vector3d(0, -2, 1).normalized()).norm(), 1e-15)
      << normals.col(0).transpose();
}

TEST(VertexNormalsTest, DegenerateFacesGiveUp) {
  const Eigen::Matrix3Xd normals =
      VertexNormals(Eigen::Matrix3Xd::Ones(3, 4), testing::Faces({{0, 1, 2}}));
  for (int v = 0; v < 4; ++v) EXPECT_EQ(Eigen::Vector3d(normals.col(v)), Eigen::Vector3d::UnitZ());
}

TEST(VertexNormalsTest, TurnWithTheMesh) {
  testing::Random random(5);
  const ControlMesh mesh = testing::Perturbed(testing::Torus(7, 5), 0.1, random);
  const Eigen::Matrix3d rotation =
      Eigen::AngleAxisd(0.7, random.Vector().normalized()).toRotationMatrix();
  const Eigen::Matrix3Xd moved = (rotation * (3.0 * mesh.vertices)).colwise() + random.Vector();
  EXPECT_LT((VertexNormals(moved, mesh.faces) - rotation * VertexNormals(mesh.vertices, mesh.faces))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
}

}  // namespace
}  // namespace rilievo
