#include "core/surface/patch_mesh.h"

#include <gtest/gtest.h>

#include "core/geometry/vertex_normals.h"
#include "tests/unit/loop/loop_meshes.h"

namespace rilievo {
namespace {

class PatchMeshTest : public ::testing::TestWithParam<testing::NamedMesh> {};

TEST_P(PatchMeshTest, HasTheRefinementsTrianglesAndTheirNormals) {
  const ControlMesh& mesh = GetParam().mesh;
  for (int level = 2; level <= 4; ++level) {
    const auto refinement = RefineTopology(mesh, level, RunContext());
    const MeshTopology& finest = refinement->levels.back();
    const Eigen::Matrix3Xd vertices = Eigen::Matrix3Xd::Random(3, finest.vertex_count);
    RunContext context;
    for (int threads : {1, 3}) {
      context.threads = threads;
      const auto patches = LoopPatches::Build(mesh, level, context);
      const auto meshed = MeshOfPatches(*patches, vertices, /*with_normals=*/true, context);
      ASSERT_TRUE(meshed.ok()) << meshed.status();
      EXPECT_EQ(meshed->vertices, vertices);
      EXPECT_EQ(meshed->triangles, finest.faces);
      EXPECT_LT((meshed->normals - VertexNormals(vertices, finest.faces)).cwiseAbs().maxCoeff(),
                1e-12);
      const auto without = MeshOfPatches(*patches, vertices, /*with_normals=*/false, context);
      ASSERT_TRUE(without.ok()) << without.status();
      EXPECT_EQ(without->vertices, vertices);
      EXPECT_EQ(without->triangles, finest.faces);
      EXPECT_EQ(without->normals.cols(), 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, PatchMeshTest, ::testing::ValuesIn(testing::LoopMeshes()),
                         [](const auto& instance) { return instance.param.name; });

TEST(PatchMeshTest, AFaceOfNoAreaHasANormalAllTheSame) {
  const ControlMesh mesh = testing::Icosahedron();
  const auto patches = LoopPatches::Build(mesh, 2, RunContext());
  const auto meshed =
      MeshOfPatches(*patches, Eigen::Matrix3Xd::Zero(3, patches->numbering().vertex_count()),
                    /*with_normals=*/true, RunContext());
  for (const auto normal : meshed->normals.colwise()) EXPECT_EQ(normal, Eigen::Vector3d::UnitZ());
}

}  // namespace
}  // namespace rilievo
