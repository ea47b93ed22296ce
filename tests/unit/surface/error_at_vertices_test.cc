#include "core/surface/error_at_vertices.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rilievo {
namespace {

TEST(ErrorAtVerticesTest, IsTheDistanceOfThePoints) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << 0, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0;
  mesh.triangles.resize(3, 2);
  mesh.triangles << 0, 0, 1, 2, 2, 3;
  Eigen::Matrix3Xd points(3, 3);
  points << 0.8, 0.9, NAN, 0.1, 0.2, 0, 0.3, -0.4, 0;
  const auto errors = ErrorAtVertices(mesh, points, {});
  ASSERT_TRUE(errors.ok()) << errors.status();
  const float rms = std::sqrt((0.09f + 0.16f) / 2);
  EXPECT_FLOAT_EQ(errors->at_vertex[1], rms);
  EXPECT_FLOAT_EQ(errors->at_vertex[0], rms);
  EXPECT_TRUE(std::isnan(errors->at_vertex[3]));  // of the triangle no point is near
  EXPECT_NEAR(errors->rms, rms, 1e-7);
  EXPECT_EQ(ErrorAtVertices(mesh, Eigen::Matrix3Xd(3, 0), {})->rms, 0);
  EXPECT_FALSE(ErrorAtVertices({mesh.vertices, {}, {}}, points, {}).ok());
}

}  // namespace
}  // namespace rilievo
