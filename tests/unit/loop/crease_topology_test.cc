#include "core/loop/crease_topology.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "core/loop/refinement.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

MeshTopology TopologyOf(const ControlMesh& mesh) {
  auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  EXPECT_TRUE(topology.ok()) << topology.status();
  return *std::move(topology);
}

CreaseTopology CreasesOf(const ControlMesh& mesh) {
  auto creases = BuildCreaseTopology(mesh, TopologyOf(mesh));
  EXPECT_TRUE(creases.ok()) << creases.status();
  return *std::move(creases);
}

// Vertices of a 5 x 5 grid, y * 5 + x; faces' diagonals run up to the right.
ControlMesh GridWith(std::vector<Crease> creases) {
  ControlMesh mesh = testing::Grid(5, 5);
  mesh.creases = std::move(creases);
  return mesh;
}

TEST(CreaseTopologyTest, CountsSharpEdgesAtVertices) {
  // Along y = 2 from x = 1 to the boundary at x = 4, and a branch at x = 3.
  const ControlMesh mesh = GridWith({{8, 13, 0.5f}, {11, 12}, {12, 13, 3.0f}, {13, 14, 20.0f}});
  const CreaseTopology creases = CreasesOf(mesh);
  EXPECT_EQ(creases.kinds[6], VertexKind::kSmooth);
  EXPECT_EQ(creases.kinds[11], VertexKind::kDart);
  EXPECT_EQ(creases.kinds[12], VertexKind::kCrease);
  EXPECT_EQ(creases.kinds[13], VertexKind::kCorner);
  EXPECT_EQ(creases.kinds[8], VertexKind::kDart);
  EXPECT_EQ(creases.kinds[14], VertexKind::kCorner);
  EXPECT_EQ(creases.kinds[0], VertexKind::kCrease) << "a boundary without creases is a crease";
  ASSERT_EQ(creases.edges.size(), 4u);
  const MeshTopology topology = TopologyOf(mesh);
  for (size_t i = 0; i < 4; ++i) {
    if (i > 0) {
      EXPECT_LT(creases.edges[i - 1].edge, creases.edges[i].edge);
    }
    const auto ends = topology.edge_vertices.col(creases.edges[i].edge);
    const auto tag = std::find_if(
        mesh.creases.begin(), mesh.creases.end(),
        [&](const Crease& crease) { return crease.a == ends[0] && crease.b == ends[1]; });
    ASSERT_NE(tag, mesh.creases.end());
    EXPECT_EQ(creases.edges[i].sharpness, std::min(tag->sharpness, kInfiniteSharpness));
  }
}

TEST(CreaseTopologyTest, TaggedBoundaryEdgesAndCornersCountOnce) {
  ControlMesh mesh = GridWith({{0, 1}, {1, 2}});
  mesh.corners = {0, 12};
  const CreaseTopology creases = CreasesOf(mesh);
  EXPECT_TRUE(creases.edges.empty());
  EXPECT_EQ(creases.kinds[1], VertexKind::kCrease);
  EXPECT_EQ(creases.kinds[0], VertexKind::kCorner);
  EXPECT_EQ(creases.kinds[12], VertexKind::kCorner);
}

TEST(CreaseTopologyTest, NamesWhatItRefuses) {
  const auto message = [](const ControlMesh& mesh) {
    const absl::Status status = RefineTopology(mesh, 1, RunContext()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
    return std::string(status.message());
  };
  EXPECT_THAT(message(GridWith({{0, 12}})), HasSubstr("crease 0-12 is not an edge"));
  EXPECT_THAT(message(GridWith({{5, 6}, {24, 25}})), HasSubstr("crease 24-25"));
  EXPECT_THAT(message(GridWith({{-1, 0}})), HasSubstr("crease -1-0"));
  EXPECT_THAT(message(GridWith({{7, 6}})), HasSubstr("crease 7-6"));
  EXPECT_THAT(message(GridWith({{6, 7, 0.0f}})), HasSubstr("crease 6-7 has sharpness 0"));
  EXPECT_THAT(message(GridWith({{6, 7, -1.0f}})), HasSubstr("sharpness"));
  EXPECT_THAT(message(GridWith({{6, 7, std::numeric_limits<float>::quiet_NaN()}})),
              HasSubstr("sharpness nan"));
  EXPECT_THAT(message(GridWith({{6, 7}, {6, 7}})), HasSubstr("crease 6-7 is listed twice"));
  EXPECT_THAT(message(GridWith({{7, 8}, {6, 7}})), HasSubstr("out of order"));
  ControlMesh mesh = testing::Grid(5, 5);
  mesh.corners = {3, 25};
  EXPECT_THAT(message(mesh), HasSubstr("corner 25 is not a vertex"));
  mesh.corners = {3, 3};
  EXPECT_THAT(message(mesh), HasSubstr("corner 3 is listed twice"));
  mesh = GridWith({{6, 7, std::numeric_limits<float>::infinity()}});
  EXPECT_TRUE(RefineTopology(mesh, 1, RunContext()).ok());
}

TEST(CreaseChainsTest, RunFromEndToEnd) {
  // A T: a bar from the left boundary (10) to a dart (13), a stem from its middle to the dart 2
  // + 5.
  const ControlMesh mesh = GridWith({{7, 12}, {10, 11}, {11, 12}, {12, 13}});
  const auto chains = CreaseChains(TopologyOf(mesh), CreasesOf(mesh));
  ASSERT_EQ(chains.size(), 3u);
  std::vector<std::vector<int>> vertices;
  for (const CreaseChain& chain : chains) {
    EXPECT_FALSE(chain.closed);
    EXPECT_EQ(chain.edges.size() + 1, chain.vertices.size());
    vertices.push_back(chain.vertices);
  }
  std::sort(vertices.begin(), vertices.end());
  EXPECT_THAT(vertices,
              ElementsAre(ElementsAre(7, 12), ElementsAre(10, 11, 12), ElementsAre(12, 13)));
}

TEST(CreaseChainsTest, CloseOrReturnToTheirCorner) {
  // Around the quad 6 7 12 11, once free and once with a corner on it.
  const std::vector<Crease> loop = {{6, 7}, {6, 11}, {7, 12}, {11, 12}};
  ControlMesh mesh = GridWith(loop);
  auto chains = CreaseChains(TopologyOf(mesh), CreasesOf(mesh));
  ASSERT_EQ(chains.size(), 1u);
  EXPECT_TRUE(chains[0].closed);
  EXPECT_EQ(chains[0].vertices.size(), 4u);
  EXPECT_EQ(chains[0].edges.size(), 4u);
  const MeshTopology topology = TopologyOf(mesh);
  for (int i = 0; i < 4; ++i) {
    const int v = chains[0].vertices[i], w = chains[0].vertices[(i + 1) % 4];
    const auto ends = topology.edge_vertices.col(chains[0].edges[i]);
    EXPECT_EQ(std::minmax(v, w), std::minmax(ends[0], ends[1]));
  }
  mesh.corners = {7};
  chains = CreaseChains(topology, CreasesOf(mesh));
  ASSERT_EQ(chains.size(), 1u);
  EXPECT_FALSE(chains[0].closed);
  ASSERT_EQ(chains[0].vertices.size(), 5u);
  EXPECT_EQ(chains[0].vertices.front(), 7);
  EXPECT_EQ(chains[0].vertices.back(), 7);
}

TEST(CreaseChainsTest, HoldEveryTaggedEdgeOnce) {
  testing::Random random(21);
  ControlMesh mesh = testing::SplitRandomFaces(testing::Torus(9, 7), 40, random);
  const MeshTopology topology = TopologyOf(mesh);
  for (int e = 0; e < topology.edge_count(); ++e) {
    if (random.Below(3) != 0) continue;
    mesh.creases.push_back({topology.edge_vertices(0, e), topology.edge_vertices(1, e)});
  }
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& x, const Crease& y) {
    return std::pair(x.a, x.b) < std::pair(y.a, y.b);
  });
  const CreaseTopology creases = CreasesOf(mesh);
  std::vector<int> seen;
  for (const CreaseChain& chain : CreaseChains(topology, creases)) {
    seen.insert(seen.end(), chain.edges.begin(), chain.edges.end());
    ASSERT_EQ(chain.edges.size() + !chain.closed, chain.vertices.size());
    for (size_t i = 0; i < chain.vertices.size(); ++i) {
      const bool end = !chain.closed && (i == 0 || i + 1 == chain.vertices.size());
      EXPECT_EQ(creases.kinds[chain.vertices[i]] != VertexKind::kCrease, end);
    }
  }
  std::sort(seen.begin(), seen.end());
  std::vector<int> tagged;
  for (const SharpEdge& sharp : creases.edges) tagged.push_back(sharp.edge);
  EXPECT_EQ(seen, tagged);
}

}  // namespace
}  // namespace rilievo
