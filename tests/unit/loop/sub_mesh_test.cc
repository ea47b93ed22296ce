#include "core/loop/sub_mesh.h"

#include <gtest/gtest.h>

#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

MeshTopology Topology(const ControlMesh& mesh) {
  return *BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
}

TEST(CutFacesOutTest, TakesAFaceAndAllThatTouchIt) {
  const ControlMesh mesh = testing::Torus(8, 6);
  const MeshTopology topology = Topology(mesh);
  std::vector<uint8_t> wanted(static_cast<size_t>(topology.face_count()), 0);
  wanted[20] = 1;
  const SubMesh sub = CutFacesOut(topology, mesh.vertices, wanted, {}, {});
  EXPECT_EQ(sub.faces.size(), 13u);
  EXPECT_EQ(sub.mesh.vertices.cols(), 12);
  for (size_t i = 0; i < sub.faces.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(sub.mesh.vertices.col(sub.mesh.faces(k, static_cast<Eigen::Index>(i))),
                mesh.vertices.col(mesh.faces(k, sub.faces[i])));
    }
  }
}

// Two faces far enough apart that what touches them meets in single vertices only.
TEST(CutFacesOutTest, AnySetOfFacesBecomesAManifold) {
  const ControlMesh mesh = testing::Torus(9, 7);
  const MeshTopology topology = Topology(mesh);
  for (int a = 0; a < topology.face_count(); a += 5) {
    for (int b = 0; b < topology.face_count(); b += 3) {
      std::vector<uint8_t> wanted(static_cast<size_t>(topology.face_count()), 0);
      wanted[static_cast<size_t>(a)] = wanted[static_cast<size_t>(b)] = 1;
      const SubMesh sub = CutFacesOut(topology, mesh.vertices, wanted, {}, {});
      const auto checked =
          BuildMeshTopology(sub.mesh.faces, static_cast<int>(sub.mesh.vertices.cols()));
      EXPECT_TRUE(checked.ok()) << a << " " << b << ": " << checked.status();
    }
  }
}

TEST(CutFacesOutTest, TagsGoWithTheirEdgesAndVertices) {
  const ControlMesh mesh = testing::Torus(8, 6);
  const MeshTopology topology = Topology(mesh);
  std::vector<uint8_t> wanted(static_cast<size_t>(topology.face_count()), 0);
  wanted[20] = 1;
  const int edge = topology.face_edges(1, 20), far = topology.face_edges(0, 60);
  std::vector<SharpEdge> sharp = {{edge, 2.5f}, {far, 1.0f}};
  if (far < edge) std::swap(sharp[0], sharp[1]);
  const int corner = topology.faces(0, 20);
  const SubMesh sub = CutFacesOut(topology, mesh.vertices, wanted, sharp, {corner});
  ASSERT_EQ(sub.mesh.creases.size(), 1u);
  EXPECT_EQ(sub.mesh.creases[0].sharpness, 2.5f);
  EXPECT_LT(sub.mesh.creases[0].a, sub.mesh.creases[0].b);
  ASSERT_EQ(sub.mesh.corners.size(), 1u);
  EXPECT_EQ(sub.mesh.vertices.col(sub.mesh.corners[0]), mesh.vertices.col(corner));
}

}  // namespace
}  // namespace rilievo
