#include <gtest/gtest.h>

#include "core/control/simplify/simplify_mesh.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

int ValenceError(const ControlMesh& mesh) {
  const auto half_edges =
      HalfEdgeMesh::Build(mesh.faces, static_cast<int>(mesh.vertices.cols()), RunContext{});
  int error = 0;
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    const int off = half_edges->Valence(v) - (half_edges->OnBoundary(v) ? 4 : 6);
    error += off * off;
  }
  return error;
}

TEST(ImproveValence, BringsValencesTowardsSix) {
  SimplifyOptions options;
  options.target_faces = 1500;
  auto mesh = SimplifyMesh(MarchTetrahedra(SphereField, 40), options, RunContext());
  ASSERT_TRUE(mesh.ok());
  const int before = ValenceError(*mesh);
  const Eigen::Matrix3Xd vertices = mesh->vertices;
  ImproveValence(&*mesh, 40);
  EXPECT_LT(ValenceError(*mesh), 0.6 * before);
  EXPECT_EQ(mesh->vertices, vertices);
  const TopologySummary summary = Summary(*mesh);
  EXPECT_TRUE(summary.manifold());
  EXPECT_TRUE(summary.oriented);
  EXPECT_EQ(summary.euler, 2);
  for (const auto& face : mesh->faces.colwise()) {
    const Vector3d a = mesh->vertices.col(face[0]), b = mesh->vertices.col(face[1]),
                   c = mesh->vertices.col(face[2]);
    EXPECT_GT((b - a).cross(c - a).dot(a + b + c - 3 * kOffset), 0);
  }
}

TEST(ImproveValence, SparesCreases) {
  // A roof: the ridge's edges may not flip, whatever their valences.
  const ControlMesh roof = Sheet(9, 9, false, [](double s, double t) -> Vector3d {
    return {s, t, -std::abs(t - 0.5)};
  });
  ControlMesh mesh = roof;
  ImproveValence(&mesh, 40);
  int ridge = 0;
  for (const auto& face : mesh.faces.colwise()) {
    for (int k = 0; k < 3; ++k) {
      ridge += mesh.vertices(1, face[k]) == 0.5 && mesh.vertices(1, face[(k + 1) % 3]) == 0.5;
    }
  }
  EXPECT_EQ(ridge, 16);
}

TEST(ImproveValence, LeavesARegularMeshAlone) {
  const ControlMesh regular = OpenCylinder(20, 12);
  ControlMesh mesh = regular;
  ImproveValence(&mesh, 40);
  EXPECT_EQ(ValenceError(mesh), ValenceError(regular));
}

TEST(ImproveValence, FlipsOneSliverPair) {
  ControlMesh kite;
  kite.vertices.resize(3, 4);
  kite.vertices << 0, 4, 2, 2,  //
      0, 0, 0.5, -0.5,          //
      0, 0, 0, 0;
  kite.faces.resize(3, 2);
  kite.faces << 0, 1, 1, 0, 2, 3;
  ImproveValence(&kite, 40);
  EXPECT_TRUE(Summary(kite).manifold());
  const std::vector<int> valences = Valences(kite);
  // Both diagonals leave the four boundary valences as far from 4; the flip rounds the faces, but
  // would leave vertices 0 and 1 with one face each, which is refused.
  EXPECT_EQ(valences, (std::vector<int>{3, 3, 2, 2}));
}

}  // namespace
}  // namespace rilievo
