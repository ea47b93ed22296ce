#include "core/control/simplify/half_edge_mesh.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

ControlMesh AsMesh(const HalfEdgeMesh& half_edges) {
  std::vector<Eigen::Vector3i> faces;
  std::map<int, int> number;
  for (int f = 0; f < half_edges.face_slots(); ++f) {
    if (!half_edges.FaceAlive(f)) continue;
    Eigen::Vector3i face;
    for (int k = 0; k < 3; ++k) {
      const int v = half_edges.From(3 * f + k);
      face[k] = number.try_emplace(v, static_cast<int>(number.size())).first->second;
    }
    faces.push_back(face);
  }
  ControlMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Zero(3, static_cast<int64_t>(number.size()));
  mesh.faces.resize(3, static_cast<int64_t>(faces.size()));
  for (size_t f = 0; f < faces.size(); ++f) mesh.faces.col(static_cast<int64_t>(f)) = faces[f];
  return mesh;
}

// Collapses what may be collapsed, in edge order, and checks the structure against one built anew.
void CollapseAndCompare(const ControlMesh& mesh, int least_valence) {
  const TopologySummary before = Summary(mesh);
  auto half_edges =
      HalfEdgeMesh::Build(mesh.faces, static_cast<int>(mesh.vertices.cols()), RunContext{});
  ASSERT_TRUE(half_edges.ok()) << half_edges.status();
  int collapsed = 0;
  for (int pass = 0; pass < 3; ++pass) {
    for (int edge = 0; edge < half_edges->edge_slots(); ++edge) {
      const int h = half_edges->HalfOfEdge(edge);
      if (h < 0 || !half_edges->CanCollapse(h, least_valence)) continue;
      half_edges->Collapse(h);
      ++collapsed;
    }
  }
  EXPECT_GT(collapsed, mesh.vertices.cols() / 2);
  const ControlMesh left = AsMesh(*half_edges);
  const TopologySummary after = Summary(left);
  EXPECT_TRUE(after.manifold());
  EXPECT_TRUE(after.oriented);
  EXPECT_EQ(after.components, before.components);
  EXPECT_EQ(after.genus, before.genus);
  EXPECT_EQ(after.boundary_loops, before.boundary_loops);

  int living_edges = 0;
  for (int edge = 0; edge < half_edges->edge_slots(); ++edge) {
    const int h = half_edges->HalfOfEdge(edge);
    if (h < 0) continue;
    ++living_edges;
    EXPECT_EQ(half_edges->Edge(h), edge);
    if (half_edges->Twin(h) < 0) continue;
    EXPECT_EQ(half_edges->Twin(half_edges->Twin(h)), h);
    EXPECT_EQ(half_edges->Edge(half_edges->Twin(h)), edge);
    EXPECT_EQ(half_edges->From(half_edges->Twin(h)), half_edges->To(h));
  }
  EXPECT_EQ(living_edges, after.edges);
  for (int v = 0; v < half_edges->vertex_slots(); ++v) {
    if (half_edges->Outgoing(v) < 0) continue;
    EXPECT_EQ(half_edges->From(half_edges->Outgoing(v)), v);
    std::set<int> neighbors;
    half_edges->ForEachNeighbor(v, [&](int neighbor, int) { neighbors.insert(neighbor); });
    EXPECT_EQ(static_cast<int>(neighbors.size()), half_edges->Valence(v));
    EXPECT_GE(half_edges->Valence(v), half_edges->OnBoundary(v) ? 2 : 3);
  }
}

TEST(HalfEdgeMesh, CollapsesKeepTheTopologyOfATorus) {
  const ControlMesh torus =
      MarchTetrahedra([](const Eigen::Vector3d& x) { return TorusField(x); }, 20);
  ASSERT_EQ(Summary(torus).genus, 1);
  CollapseAndCompare(torus, 3);
  CollapseAndCompare(torus, 4);
}

TEST(HalfEdgeMesh, CollapsesKeepBothLoopsOfACylinder) {
  CollapseAndCompare(OpenCylinder(24, 15), 3);
  CollapseAndCompare(OpenCylinder(24, 15), 4);
}

TEST(HalfEdgeMesh, NoEdgeOfATetrahedronCollapses) {
  Eigen::Matrix3Xi faces(3, 4);
  faces << 0, 0, 0, 1,  //
      1, 2, 3, 3,       //
      2, 3, 1, 2;
  auto half_edges = HalfEdgeMesh::Build(faces, 4, RunContext{});
  ASSERT_TRUE(half_edges.ok()) << half_edges.status();
  for (int h = 0; h < 12; ++h) EXPECT_FALSE(half_edges->CanCollapse(h, 3));
}

TEST(HalfEdgeMesh, AnInnerEdgeBetweenBoundaryVerticesStays) {
  Eigen::Matrix3Xi strip(3, 4);
  strip << 0, 1, 2, 3,  //
      1, 3, 3, 5,       //
      2, 2, 4, 4;
  auto half_edges = HalfEdgeMesh::Build(strip, 6, RunContext{});
  ASSERT_TRUE(half_edges.ok()) << half_edges.status();
  for (int h = 0; h < 12; ++h) {
    if (half_edges->Twin(h) < 0) continue;
    EXPECT_FALSE(half_edges->CanCollapse(h, 3));
  }
}

TEST(HalfEdgeMesh, RefusesWhatIsNoManifold) {
  Eigen::Matrix3Xi faces(3, 2);
  const auto message = [&](int vertices) {
    return std::string(HalfEdgeMesh::Build(faces, vertices, RunContext{}).status().message());
  };
  faces << 0, 0, 1, 1, 2, 3;
  EXPECT_NE(message(4).find("twice in the same direction"), std::string::npos);
  faces << 0, 0, 1, 3, 2, 4;
  EXPECT_NE(message(5).find("more than one fan"), std::string::npos);
  faces << 0, 1, 1, 1, 2, 3;
  EXPECT_NE(message(4).find("uses vertex 1 twice"), std::string::npos);
  faces << 0, 1, 1, 7, 2, 3;
  EXPECT_NE(message(4).find("outside [0, 4)"), std::string::npos);
}

}  // namespace
}  // namespace rilievo
