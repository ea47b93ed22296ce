#include "core/control/simplify/mesh_subset.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/geometry/mesh_topology.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

TEST(MeshSubsetTest, ABowTieBecomesTwoTriangles) {
  ControlMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Random(3, 6);  // the sixth is unused
  mesh.faces.resize(3, 2);
  mesh.faces << 0, 0, 1, 3, 2, 4;
  const auto [split, source] = SplitFans(mesh);
  EXPECT_EQ(split.vertices.cols(), 6);
  EXPECT_TRUE(BuildMeshTopology(split.faces, 6).ok());
  for (int f = 0; f < 2; ++f) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(source[split.faces(k, f)], mesh.faces(k, f));
      EXPECT_EQ(split.vertices.col(split.faces(k, f)), mesh.vertices.col(mesh.faces(k, f)));
    }
  }
}

// Every third face of a sphere: many touch in a vertex alone.
TEST(MeshSubsetTest, KeptFacesAreTheSamePlaces) {
  const ControlMesh mesh = MarchTetrahedra(SphereField, 8);
  std::vector<uint8_t> keep(mesh.faces.cols(), 0);
  for (int f = 0; f < mesh.faces.cols(); f += 3) keep[f] = 1;
  const auto [part, source] = KeepFaces(mesh, keep);
  ASSERT_EQ(part.faces.cols(), std::count(keep.begin(), keep.end(), 1));
  ASSERT_EQ(part.vertices.cols(), static_cast<int64_t>(source.size()));
  EXPECT_TRUE(BuildMeshTopology(part.faces, static_cast<int>(source.size())).ok());
  for (int f = 0, kept = 0; f < mesh.faces.cols(); ++f) {
    if (keep[f] == 0) continue;
    for (int k = 0; k < 3; ++k) EXPECT_EQ(source[part.faces(k, kept)], mesh.faces(k, f));
    ++kept;
  }
  for (size_t v = 0; v < source.size(); ++v) {
    EXPECT_EQ(part.vertices.col(static_cast<int64_t>(v)), mesh.vertices.col(source[v]));
  }
}

}  // namespace
}  // namespace rilievo
