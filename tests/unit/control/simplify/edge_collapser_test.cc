#include "core/control/simplify/edge_collapser.h"

#include <gtest/gtest.h>

#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

Field Torus() {
  return [](const Eigen::Vector3d& x) { return TorusField(x); };
}

struct Collapse {
  explicit Collapse(const ControlMesh& mesh)
      : collapser(
            HalfEdgeMesh::Build(mesh.faces, static_cast<int>(mesh.vertices.cols()), RunContext{})
                .value(),
            mesh, options, nullptr, RunContext{}) {}
  SimplifyOptions options;
  EdgeCollapser collapser;
};

// A tenth of the faces is left within each block, and the rims. A triangle of edge e lies e^2 / (6
// r) off a circle of radius r: here 0.002 at a mean edge of 0.04 around the tube, 0.12.
TEST(EdgeCollapserTest, BlocksKeepTheTopologyAndTheShape) {
  const ControlMesh mesh = MarchTetrahedra(Torus(), 60);
  for (const int threads : {1, 2}) {
    Collapse collapse(mesh);
    RunContext context;
    context.threads = threads;
    const VertexBlocks blocks =
        CutIntoBlocks(collapse.collapser.mesh(), mesh.vertices, 2000, context).value();
    ASSERT_GT(blocks.count(), 4);
    ASSERT_TRUE(collapse.collapser.CollapseBlocks(blocks, 0.1, context).ok());
    const ControlMesh result = collapse.collapser.Compact();
    EXPECT_EQ(result.faces.cols(), collapse.collapser.faces_left());
    EXPECT_LT(result.faces.cols(), mesh.faces.cols() / 2);
    const TopologySummary topology = Summary(result);
    EXPECT_TRUE(topology.manifold() && topology.oriented && topology.closed());
    EXPECT_EQ(topology.genus, 1);
    EXPECT_EQ(topology.components, 1);
    EXPECT_LT(LargestField(result, Torus()), 0.005);
  }
}

TEST(EdgeCollapserTest, BlocksComeOutTheSameForAnyNumberOfThreads) {
  const ControlMesh mesh = MarchTetrahedra(Torus(), 40);
  ControlMesh results[2];
  for (const int threads : {1, 2}) {
    Collapse collapse(mesh);
    RunContext context;
    context.threads = threads;
    const VertexBlocks blocks =
        CutIntoBlocks(collapse.collapser.mesh(), mesh.vertices, 800, context).value();
    ASSERT_TRUE(collapse.collapser.CollapseBlocks(blocks, 0.1, context).ok());
    ASSERT_TRUE(collapse.collapser.CollapseTo(400, context).ok());
    results[threads - 1] = collapse.collapser.Compact();
  }
  EXPECT_EQ(results[0].faces, results[1].faces);
  EXPECT_EQ(results[0].vertices, results[1].vertices);
}

TEST(EdgeCollapserTest, ATargetIsReachedExactlyOrByOneFace) {
  const ControlMesh mesh = MarchTetrahedra(SphereField, 24);
  Collapse collapse(mesh);
  ASSERT_TRUE(collapse.collapser.CollapseTo(1000, RunContext()).ok());
  EXPECT_LE(collapse.collapser.faces_left(), 1000);
  EXPECT_GE(collapse.collapser.faces_left(), 999);
}

TEST(EdgeCollapserTest, StopsWhenAsked) {
  const ControlMesh mesh = MarchTetrahedra(SphereField, 24);
  Collapse collapse(mesh);
  const VertexBlocks blocks =
      CutIntoBlocks(collapse.collapser.mesh(), mesh.vertices, 800, RunContext()).value();
  EXPECT_EQ(collapse.collapser.CollapseBlocks(blocks, 0.1, Stopped()).code(),
            absl::StatusCode::kCancelled);
  EXPECT_EQ(collapse.collapser.CollapseTo(100, Stopped()).code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
