// Creases, darts and corners against OpenSubdiv, on every level.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/loop/refinement.h"
#include "core/loop/split_normals.h"
#include "tests/unit/loop/crease_meshes.h"
#include "tests/unit/loop/opensubdiv_oracle.h"

namespace rilievo {
namespace {

// From this level on all semi-sharp edges of the meshes are smooth.
constexpr int kSettled = 3;

LoopRefinement Refine(const ControlMesh& mesh, int max_level) {
  auto refinement = RefineTopology(mesh, max_level, RunContext());
  EXPECT_TRUE(refinement.ok()) << refinement.status();
  return *std::move(refinement);
}

LimitSurface Limit(const LoopRefinement& refinement, const Eigen::Matrix3Xd& points, int level) {
  auto limit = EvaluateLimit(refinement, points, level, RunContext());
  EXPECT_TRUE(limit.ok()) << limit.status();
  return *std::move(limit);
}

double MaxDifference(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

// Kinds of the vertices of a level by the edges that stay sharp.
std::vector<VertexKind> SettledKinds(const ControlMesh& mesh) {
  ControlMesh settled = mesh;
  std::erase_if(settled.creases,
                [](const Crease& crease) { return crease.sharpness < kInfiniteSharpness; });
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  return BuildCreaseTopology(settled, *topology)->kinds;
}

class CreaseOracleTest : public ::testing::TestWithParam<testing::NamedMesh> {
 protected:
  const ControlMesh& mesh() const { return GetParam().mesh; }
};

TEST_P(CreaseOracleTest, SubdividesLikeOpenSubdiv) {
  const LoopRefinement refinement = Refine(mesh(), 4);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh(), refinement);
  Eigen::Matrix3Xd positions = mesh().vertices;
  for (int level = 0; level <= 4; ++level) {
    // OpenSubdiv keeps its vertex weights in single precision where rules blend.
    EXPECT_LT(MaxDifference(positions, oracle[level].positions), 1e-12) << level;
    if (level < 4) positions = SubdivideOnce(refinement, level, positions);
  }
}

TEST_P(CreaseOracleTest, LimitPositionsAreOpenSubdivs) {
  const LoopRefinement refinement = Refine(mesh(), kSettled);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh(), refinement);
  const std::vector<VertexKind> kinds = SettledKinds(mesh());
  const LimitSurface limit = Limit(refinement, mesh().vertices, kSettled);
  int darts = 0;
  for (int v = 0; v < limit.positions.cols(); ++v) {
    // Darts: see DartLimitsAreWhereTheRingStays.
    if (v < static_cast<int>(kinds.size()) && kinds[v] == VertexKind::kDart) {
      ++darts;
      continue;
    }
    EXPECT_LT((limit.positions.col(v) - oracle[kSettled].limit_positions.col(v)).norm(), 1e-9) << v;
  }
  EXPECT_LT(darts, mesh().vertices.cols());
}

INSTANTIATE_TEST_SUITE_P(Meshes, CreaseOracleTest, ::testing::ValuesIn(testing::CreaseMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

}  // namespace
}  // namespace rilievo
