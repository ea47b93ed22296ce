#include "core/loop/loop_patches.h"

#include <gtest/gtest.h>

#include <atomic>

#include "tests/unit/loop/crease_meshes.h"
#include "tests/unit/loop/loop_meshes.h"

namespace rilievo {
namespace {

struct Patched {
  Eigen::Matrix3Xd positions, normals;
  std::vector<int> times;  // that each vertex came
};

Patched Evaluate(const ControlMesh& mesh, int level, int threads) {
  RunContext context;
  context.threads = threads;
  const auto patches = LoopPatches::Build(mesh, level, context);
  EXPECT_TRUE(patches.ok()) << patches.status();
  const int count = patches->numbering().vertex_count();
  Patched result{Eigen::Matrix3Xd(3, count), Eigen::Matrix3Xd(3, count),
                 std::vector<int>(static_cast<size_t>(count), 0)};
  const absl::Status status =
      patches->Evaluate(context, [&](int first, std::span<const LimitPoint> points) {
        for (const LimitPoint& point : points) {
          result.positions.col(first) = point.position;
          result.normals.col(first) = point.normal;
          ++result.times[static_cast<size_t>(first++)];
        }
      });
  EXPECT_TRUE(status.ok()) << status;
  return result;
}

class LoopPatchesTest : public ::testing::TestWithParam<testing::NamedMesh> {};

TEST_P(LoopPatchesTest, AreTheLimitSurfaceOnEveryLevel) {
  const ControlMesh& mesh = GetParam().mesh;
  for (int level = LoopPatches::kLeastLevel; level <= 6; ++level) {
    if (mesh.faces.cols() << (2 * level) > 1000000) break;
    const auto refinement = RefineTopology(mesh, level - 1, RunContext());
    const LimitSurface limit = *EvaluateLimit(*refinement, mesh.vertices, level, RunContext());
    const Patched patched = Evaluate(mesh, level, 2);
    ASSERT_EQ(patched.positions.cols(), limit.positions.cols());
    EXPECT_EQ(patched.times, std::vector<int>(patched.times.size(), 1));
    EXPECT_LT((patched.positions - limit.positions).cwiseAbs().maxCoeff(), 1e-13) << level;
    EXPECT_LT((patched.normals - limit.normals).colwise().norm().maxCoeff(), 1e-8) << level;
  }
}

TEST_P(LoopPatchesTest, ThreadsDoNotChangeABit) {
  const Patched one = Evaluate(GetParam().mesh, 3, 1), four = Evaluate(GetParam().mesh, 3, 4);
  EXPECT_EQ(one.positions, four.positions);
  EXPECT_EQ(one.normals, four.normals);
}

INSTANTIATE_TEST_SUITE_P(Smooth, LoopPatchesTest, ::testing::ValuesIn(testing::LoopMeshes()),
                         [](const auto& instance) { return instance.param.name; });
INSTANTIATE_TEST_SUITE_P(Creased, LoopPatchesTest, ::testing::ValuesIn(testing::CreaseMeshes()),
                         [](const auto& instance) { return instance.param.name; });

TEST(LoopPatchesTest, OtherLevelsAreRefused) {
  for (int level : {-1, 0, 1, 9}) {
    EXPECT_EQ(LoopPatches::Build(testing::Icosahedron(), level, RunContext()).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

TEST(LoopPatchesTest, AFlatSpotTakesTheCommonWay) {
  ControlMesh mesh = testing::Torus(8, 6);
  mesh.vertices.leftCols(30).setZero();  // tangents of no length
  const auto refinement = RefineTopology(mesh, 2, RunContext());
  const LimitSurface limit = *EvaluateLimit(*refinement, mesh.vertices, 3, RunContext());
  const Patched patched = Evaluate(mesh, 3, 1);
  EXPECT_LT((patched.positions - limit.positions).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_TRUE(patched.normals.allFinite());
}

}  // namespace
}  // namespace rilievo
