#include "core/geometry/mesh_topology.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>

#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

using ::rilievo::testing::Faces;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The header's words, one by one.
void ExpectAsTheHeaderSays(const MeshTopology& topology) {
  std::map<std::pair<int, int>, int> numbers;
  std::vector<std::vector<int>> faces_of_edge;
  std::vector<int> valence(topology.vertex_count, 0);
  for (int f = 0; f < topology.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto key = std::minmax({topology.faces(k, f), topology.faces((k + 1) % 3, f)});
      const auto [entry, first] = numbers.try_emplace(key, static_cast<int>(numbers.size()));
      if (first) {
        faces_of_edge.emplace_back();
        ++valence[key.first];
        ++valence[key.second];
      }
      faces_of_edge[entry->second].push_back(f);
      EXPECT_EQ(topology.face_edges(k, f), entry->second);
    }
  }
  ASSERT_EQ(topology.edge_count(), static_cast<int>(numbers.size()));
  std::vector<uint8_t> boundary(topology.vertex_count, 0);
  for (const auto& [key, e] : numbers) {
    const std::vector<int>& faces = faces_of_edge[e];
    EXPECT_EQ(topology.edge_vertices(0, e), key.first);
    EXPECT_EQ(topology.edge_vertices(1, e), key.second);
    EXPECT_EQ(topology.edge_faces(0, e), faces[0]);
    EXPECT_EQ(topology.edge_faces(1, e), faces.size() > 1 ? faces[1] : -1);
    if (faces.size() == 1) boundary[key.first] = boundary[key.second] = 1;
  }
  for (int f = 0; f < topology.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const std::vector<int>& faces = faces_of_edge[topology.face_edges(k, f)];
      const int neighbor = faces.size() == 1 ? -1 : faces[0] == f ? faces[1] : faces[0];
      EXPECT_EQ(topology.face_neighbors(k, f), neighbor);
    }
  }
  EXPECT_EQ(topology.valence, valence);
  EXPECT_EQ(topology.boundary_vertex, boundary);
}

TEST(BuildMeshTopologyTest, FillsEveryFieldAsStated) {
  testing::Random random(1);
  for (const ControlMesh& mesh :
       {testing::Tetrahedron(), testing::Icosahedron(), testing::Bipyramid(50),
        testing::Torus(5, 4), testing::Grid(6, 4), testing::HalfFan(1),
        testing::SplitRandomFaces(testing::Grid(5, 5), 40, random),
        testing::Union(testing::Grid(3, 3), testing::Icosahedron())}) {
    const Eigen::Matrix3Xi faces = testing::WithShuffledFaces(mesh.faces, random);
    const auto topology = BuildMeshTopology(faces, static_cast<int>(mesh.vertices.cols()));
    ASSERT_TRUE(topology.ok()) << topology.status();
    EXPECT_EQ(topology->faces, faces);
    ExpectAsTheHeaderSays(*topology);
  }
}

struct BadMesh {
  const char* name;
  Eigen::Matrix3Xi faces;
  int vertex_count;
  std::vector<std::string> message;
};

class BuildMeshTopologyRefusalTest : public ::testing::TestWithParam<BadMesh> {};

TEST_P(BuildMeshTopologyRefusalTest, NamesTheOffender) {
  const auto topology = BuildMeshTopology(GetParam().faces, GetParam().vertex_count);
  ASSERT_EQ(topology.status().code(), absl::StatusCode::kInvalidArgument);
  for (const std::string& part : GetParam().message) {
    EXPECT_THAT(std::string(topology.status().message()), HasSubstr(part));
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, BuildMeshTopologyRefusalTest,
    ::testing::Values(
        BadMesh{"NoFaces", Faces({}), 3, {"no faces"}},
        BadMesh{"NegativeCount", Faces({{0, 1, 2}}), -1, {"vertex_count is -1"}},
        BadMesh{
            "IndexTooLarge", Faces({{0, 1, 2}, {0, 2, 4}}), 4, {"face 1", "vertex 4", "0 to 3"}},
        BadMesh{"NegativeIndex", Faces({{0, -7, 2}}), 3, {"face 0", "vertex -7"}},
        BadMesh{"Degenerate", Faces({{0, 1, 2}, {3, 2, 3}}), 4, {"face 1", "vertex 3 twice"}},
        BadMesh{"ThreeFacesOnAnEdge",
                Faces({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}),
                5,
                {"edge 0-1", "3 faces", "0, 1, 2"}},
        BadMesh{"FlippedFace",
                Faces({{0, 1, 2}, {1, 2, 3}}),
                4,
                {"faces 0 and 1", "edge 1-2", "same direction"}},
        BadMesh{"DoubledFace", Faces({{0, 1, 2}, {0, 1, 2}}), 3, {"same direction"}},
        BadMesh{"TwoFacesBackToBack",
                Faces({{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}, {4, 5, 6}, {5, 4, 6}}),
                7,
                {"faces 4 and 5", "same three vertices"}},
        BadMesh{"MobiusStrip",
                Faces({{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 0}, {4, 0, 1}}),
                5,
                {"same direction"}},
        BadMesh{"BowTie", Faces({{0, 1, 2}, {0, 3, 4}}), 5, {"vertex 0", "more than one fan"}},
        BadMesh{"ClosedBowTie",
                Faces({{0, 1, 2},
                       {0, 2, 3},
                       {0, 3, 1},
                       {1, 3, 2},
                       {0, 4, 5},
                       {0, 5, 6},
                       {0, 6, 4},
                       {4, 6, 5}}),
                7,
                {"vertex 0", "more than one fan"}},
        BadMesh{"UnusedVertex", Faces({{0, 1, 3}}), 4, {"vertex 2", "no face"}}),
    [](const auto& bad) { return bad.param.name; });

TEST(BoundaryLoopsTest, FollowTheFaces) {
  const auto closed = BuildMeshTopology(testing::Icosahedron().faces, 12);
  ASSERT_TRUE(closed.ok());
  EXPECT_TRUE(BoundaryLoops(*closed).empty());

  const auto square = BuildMeshTopology(Faces({{0, 1, 3}, {0, 3, 2}}), 4);
  ASSERT_TRUE(square.ok());
  EXPECT_THAT(BoundaryLoops(*square), ElementsAre(ElementsAre(0, 1, 3, 2)));
}

TEST(BoundaryLoopsTest, AnnulusHasTwo) {
  // A torus grid cut open along one of its circles.
  const int around = 7;
  ControlMesh grid = testing::Grid(around + 1, 3);
  for (int i = 0; i < grid.faces.size(); ++i) {
    int& v = grid.faces.data()[i];
    v = v / (around + 1) * around + v % (around + 1) % around;
  }
  const auto annulus = BuildMeshTopology(grid.faces, 3 * around);
  ASSERT_TRUE(annulus.ok()) << annulus.status();
  const auto loops = BoundaryLoops(*annulus);
  ASSERT_EQ(loops.size(), 2u);
  EXPECT_THAT(loops[0], ElementsAre(0, 1, 2, 3, 4, 5, 6));
  EXPECT_THAT(loops[1], ElementsAre(14, 20, 19, 18, 17, 16, 15));
}

TEST(BuildVertexRingsTest, TurnCounterClockwiseThroughEveryFace) {
  testing::Random random(2);
  for (const ControlMesh& mesh :
       {testing::Tetrahedron(), testing::Bipyramid(50), testing::Torus(4, 3), testing::Grid(5, 4),
        testing::HalfFan(6), testing::SplitRandomFaces(testing::Grid(4, 4), 30, random)}) {
    const auto topology =
        BuildMeshTopology(testing::WithShuffledFaces(mesh.faces, random), mesh.vertices.cols());
    ASSERT_TRUE(topology.ok());
    const VertexRings rings = BuildVertexRings(*topology);
    // Each step of a ring, (v, p_i, p_{i+1}), must be a face; together they are all the corners.
    std::map<std::array<int, 3>, int> steps, corners;
    for (int f = 0; f < topology->face_count(); ++f) {
      const Eigen::Vector3i face = topology->faces.col(f);
      for (int k = 0; k < 3; ++k) ++corners[{face[k], face[(k + 1) % 3], face[(k + 2) % 3]}];
    }
    ASSERT_EQ(rings.neighbor_begin.size(), static_cast<size_t>(topology->vertex_count) + 1);
    for (int v = 0; v < topology->vertex_count; ++v) {
      const int begin = rings.neighbor_begin[v], count = rings.neighbor_begin[v + 1] - begin;
      EXPECT_EQ(count, topology->valence[v]);
      const int faces = topology->boundary_vertex[v] ? count - 1 : count;
      for (int i = 0; i < faces; ++i) {
        ++steps[{v, rings.neighbors[begin + i], rings.neighbors[begin + (i + 1) % count]}];
      }
    }
    EXPECT_EQ(steps, corners);
  }
}

}  // namespace
}  // namespace rilievo
