#include "core/control/simplify/vertex_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

TEST(VertexBlocksTest, EveryVertexLiesInOneBlockAndInnerOnesKnowNoOther) {
  const ControlMesh mesh = MarchTetrahedra(SphereField, 24);
  const int count = static_cast<int>(mesh.vertices.cols());
  const HalfEdgeMesh half_edges = HalfEdgeMesh::Build(mesh.faces, count, RunContext{}).value();
  const VertexBlocks blocks = CutIntoBlocks(half_edges, mesh.vertices, 500, RunContext()).value();
  EXPECT_EQ(blocks.count(), (count + 499) / 500);
  std::vector<int> order = blocks.order;
  std::sort(order.begin(), order.end());
  for (int v = 0; v < count; ++v) ASSERT_EQ(order[v], v);
  for (int k = 0; k < blocks.count(); ++k) {
    for (int i = blocks.begin[k]; i < blocks.begin[k + 1]; ++i) {
      ASSERT_EQ(blocks.block_of[blocks.order[i]], k);
    }
  }
  for (int v = 0; v < count; ++v) {
    bool alone = true;
    half_edges.ForEachNeighbor(
        v, [&](int w, int) { alone = alone && blocks.block_of[w] == blocks.block_of[v]; });
    EXPECT_EQ(blocks.inner[v] != 0, alone);
  }
  EXPECT_GT(std::count(blocks.inner.begin(), blocks.inner.end(), 1), count / 2)
      << "blocks are compact";
}

TEST(VertexBlocksTest, AVertexWithoutAFaceIsNotInner) {
  ControlMesh mesh = OpenCylinder(12, 5);
  const int count = static_cast<int>(mesh.vertices.cols());
  mesh.vertices.conservativeResize(3, count + 1);
  mesh.vertices.col(count).setZero();
  const HalfEdgeMesh half_edges = HalfEdgeMesh::Build(mesh.faces, count + 1, RunContext{}).value();
  const VertexBlocks blocks = CutIntoBlocks(half_edges, mesh.vertices, 1000, RunContext()).value();
  EXPECT_EQ(blocks.inner[count], 0);
  EXPECT_EQ(std::count(blocks.inner.begin(), blocks.inner.end(), 1), count);
}

TEST(VertexBlocksTest, StopsWhenAsked) {
  const ControlMesh mesh = OpenCylinder(12, 5);
  const HalfEdgeMesh half_edges =
      HalfEdgeMesh::Build(mesh.faces, static_cast<int>(mesh.vertices.cols()), RunContext{}).value();
  EXPECT_EQ(CutIntoBlocks(half_edges, mesh.vertices, 10, Stopped()).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
