#include <gtest/gtest.h>

#include <map>
#include <set>

#include "core/geometry/mesh_topology.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

using ::rilievo::testing::Faces;

TopologySummary SummaryOf(const ControlMesh& mesh) {
  return SummarizeTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
}

int64_t GenusOf(const ControlMesh& mesh) {
  return Genus(BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())).value());
}

TEST(SummarizeTopologyTest, ClosedSurfacesHaveTheirGenus) {
  const ControlMesh torus = testing::Torus(8, 5);
  const ControlMesh genus2 = testing::ConnectedSum(torus, torus);
  struct {
    ControlMesh mesh;
    int genus;
  } const cases[] = {{testing::Tetrahedron(), 0},
                     {testing::Icosahedron(), 0},
                     {torus, 1},
                     {genus2, 2},
                     {testing::ConnectedSum(genus2, testing::Torus(4, 4)), 3}};
  for (const auto& [mesh, genus] : cases) {
    const TopologySummary summary = SummaryOf(mesh);
    EXPECT_EQ(summary.genus, genus);
    EXPECT_EQ(GenusOf(mesh), genus);
    EXPECT_EQ(summary.euler, 2 - 2 * genus);
    EXPECT_EQ(2 * summary.edges, 3 * summary.faces);
    EXPECT_EQ(summary.components, 1);
    EXPECT_TRUE(summary.closed());
    EXPECT_TRUE(summary.manifold());
    EXPECT_TRUE(summary.oriented);
  }
}

TEST(SummarizeTopologyTest, GenusOfComponentsAddsUp) {
  const ControlMesh torus = testing::Torus(6, 4);
  const ControlMesh mesh = testing::Union(testing::Union(torus, testing::Grid(4, 3)), torus);
  const TopologySummary summary = SummaryOf(mesh);
  EXPECT_EQ(summary.components, 3);
  EXPECT_EQ(summary.genus, 2);
  EXPECT_EQ(GenusOf(mesh), 2);
  EXPECT_EQ(summary.boundary_loops, 1);
  EXPECT_EQ(summary.boundary_edges, 10);
}

TEST(SummarizeTopologyTest, HolesOfATorusLeaveItsGenus) {
  ControlMesh torus = testing::Torus(9, 9);
  torus.faces.col(0) = torus.faces.rightCols<1>();  // far apart: two holes of three edges
  torus.faces.col(40) = torus.faces.col(torus.faces.cols() - 2);
  torus.faces.conservativeResize(3, torus.faces.cols() - 2);
  // Columns 0 and 40 now hold the faces that were cut off at the end.
  const TopologySummary summary = SummaryOf(torus);
  EXPECT_EQ(summary.boundary_loops, 2);
  EXPECT_EQ(summary.boundary_edges, 6);
  EXPECT_EQ(summary.genus, 1);
  EXPECT_EQ(GenusOf(torus), 1);
  EXPECT_FALSE(summary.closed());
}

TEST(SummarizeTopologyTest, CountsDefects) {
  // Two tetrahedra that share a vertex, and one that shares an edge with the second.
  const Eigen::Matrix3Xi faces = Faces({{0, 1, 2},
                                        {0, 2, 3},
                                        {0, 3, 1},
                                        {1, 3, 2},
                                        {0, 4, 5},
                                        {0, 5, 6},
                                        {0, 6, 4},
                                        {4, 6, 5},
                                        {4, 7, 5},
                                        {4, 5, 8},
                                        {4, 8, 7},
                                        {5, 7, 8}});
  const TopologySummary summary = SummarizeTopology(faces, 9);
  EXPECT_EQ(summary.nonmanifold_vertices, 1);
  EXPECT_EQ(summary.nonmanifold_edges, 1);
  EXPECT_EQ(summary.boundary_edges, 0);
  EXPECT_EQ(summary.components, 1);
  EXPECT_FALSE(summary.oriented);
  EXPECT_FALSE(summary.manifold());
  EXPECT_FALSE(summary.closed());
}

TEST(SummarizeTopologyTest, LeavesOutImpossibleFacesAndUnusedVertices) {
  Eigen::Matrix3Xi faces(3, 7);
  faces << testing::Tetrahedron().faces, Faces({{0, 0, 1}, {2, 3, 99}, {-1, 2, 3}});
  const TopologySummary summary = SummarizeTopology(faces, 10);
  EXPECT_EQ(summary.faces, 4);
  EXPECT_EQ(summary.vertices, 4);
  EXPECT_EQ(summary.euler, 2);
  EXPECT_EQ(summary.components, 1);
  EXPECT_TRUE(summary.closed());
}

TEST(SummarizeTopologyTest, NothingIsNothing) {
  for (const int vertex_count : {-5, 0, 7}) {
    const TopologySummary summary = SummarizeTopology(Eigen::Matrix3Xi(3, 0), vertex_count);
    EXPECT_EQ(summary.vertices, 0);
    EXPECT_EQ(summary.components, 0);
    EXPECT_EQ(summary.genus, 0);
  }
}

TEST(SummarizeTopologyTest, FlippedFaceIsNotOriented) {
  ControlMesh mesh = testing::Icosahedron();
  std::swap(mesh.faces(0, 7), mesh.faces(1, 7));
  const TopologySummary summary = SummaryOf(mesh);
  EXPECT_FALSE(summary.oriented);
  EXPECT_TRUE(summary.manifold());
  EXPECT_TRUE(summary.closed());
}

// Fans of faces around a vertex, by flooding over shared edges.
int CountFans(const Eigen::Matrix3Xi& faces, int vertex) {
  std::set<int> left;
  for (int f = 0; f < faces.cols(); ++f) {
    if ((faces.col(f).array() == vertex).any()) left.insert(f);
  }
  int fans = 0;
  for (; !left.empty(); ++fans) {
    std::vector<int> front = {*left.begin()};
    left.erase(left.begin());
    while (!front.empty()) {
      const Eigen::Vector3i face = faces.col(front.back());
      front.pop_back();
      for (auto it = left.begin(); it != left.end();) {
        int shared = 0;
        for (int k = 0; k < 3; ++k) shared += (faces.col(*it).array() == face[k]).any();
        if (shared >= 2) front.push_back(*it);
        it = shared >= 2 ? left.erase(it) : std::next(it);
      }
    }
  }
  return fans;
}

TEST(SummarizeTopologyTest, AgreesWithBruteForceOnRandomTriangles) {
  testing::Random random(3);
  for (int round = 0; round < 200; ++round) {
    const int vertex_count = 4 + random.Below(12), face_count = 1 + random.Below(24);
    Eigen::Matrix3Xi faces(3, face_count);
    for (int f = 0; f < face_count; ++f) {
      const int a = random.Below(vertex_count),
                b = (a + 1 + random.Below(vertex_count - 1)) % vertex_count;
      int c = a;
      while (c == a || c == b) c = random.Below(vertex_count);
      faces.col(f) << a, b, c;
    }
    std::map<std::pair<int, int>, std::pair<int, int>> edges;  // runs up, runs down
    for (int f = 0; f < face_count; ++f) {
      for (int k = 0; k < 3; ++k) {
        const int from = faces(k, f), to = faces((k + 1) % 3, f);
        auto& [up, down] = edges[std::minmax({from, to})];
        ++(from < to ? up : down);
      }
    }
    int boundary = 0, nonmanifold = 0;
    bool oriented = true;
    for (const auto& [key, runs] : edges) {
      boundary += runs.first + runs.second == 1;
      nonmanifold += runs.first + runs.second > 2;
      oriented = oriented && runs.first < 2 && runs.second < 2;
    }
    int used = 0, nonmanifold_vertices = 0;
    for (int v = 0; v < vertex_count; ++v) {
      const int fans = CountFans(faces, v);
      used += fans > 0;
      nonmanifold_vertices += fans > 1;
    }
    const TopologySummary summary = SummarizeTopology(faces, vertex_count);
    EXPECT_EQ(summary.vertices, used);
    EXPECT_EQ(summary.edges, static_cast<int64_t>(edges.size()));
    EXPECT_EQ(summary.boundary_edges, boundary);
    EXPECT_EQ(summary.nonmanifold_edges, nonmanifold);
    EXPECT_EQ(summary.nonmanifold_vertices, nonmanifold_vertices);
    EXPECT_EQ(summary.oriented, oriented);
    EXPECT_EQ(BuildMeshTopology(faces, vertex_count).ok(),
              summary.manifold() && oriented && used == vertex_count);
  }
}

TEST(SummarizeTopologyTest, LoopsAgreeWithBoundaryLoopsOnManifolds) {
  testing::Random random(4);
  for (int round = 0; round < 100; ++round) {
    // A grid with random faces knocked out; where that leaves a manifold, both must count alike.
    ControlMesh grid = testing::Grid(6, 6);
    Eigen::Index kept = 0;
    for (Eigen::Index f = 0; f < grid.faces.cols(); ++f) {
      if (random.Below(8) > 0) grid.faces.col(kept++) = grid.faces.col(f).eval();
    }
    grid.faces.conservativeResize(3, kept);
    const auto topology = BuildMeshTopology(grid.faces, 36);
    if (!topology.ok()) continue;
    const TopologySummary summary = SummaryOf(grid);
    EXPECT_EQ(summary.boundary_loops, static_cast<int64_t>(BoundaryLoops(*topology).size()));
    EXPECT_EQ(summary.genus, 0);
  }
}

}  // namespace
}  // namespace rilievo
