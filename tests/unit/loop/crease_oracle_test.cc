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

using testing::Refine;

// From this level on all semi-sharp edges of the meshes are smooth.
constexpr int kSettled = 3;

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
    EXPECT_LT(MaxDifference(positions, oracle[level].positions), 1e-12) << level;
    if (level < 4) positions = SubdivideOnce(refinement, level, positions);
  }
}

TEST_P(CreaseOracleTest, LimitPositionsAreOpenSubdivs) {
  const LoopRefinement refinement = Refine(mesh(), kSettled);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh(), refinement);
  const std::vector<VertexKind> kinds = SettledKinds(mesh());
  const LimitSurface limit = Limit(refinement, mesh().vertices, kSettled);
  for (int v = 0; v < limit.positions.cols(); ++v) {
    if (v < static_cast<int>(kinds.size()) && kinds[v] == VertexKind::kDart) continue;
    EXPECT_LT((limit.positions.col(v) - oracle[kSettled].limit_positions.col(v)).norm(), 1e-9) << v;
  }
}

// A mesh of OpenSubdiv's points of level 2, tagged with what is left of the sharpness, has the
// limits of the mesh itself. For darts, where OpenSubdiv's own limit mask is the smooth one, this
// and the weights' sum of one leave but one mask.
TEST_P(CreaseOracleTest, LimitsStayWhenOpenSubdivRefines) {
  const LoopRefinement refinement = Refine(mesh(), 2);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh(), refinement);
  const LimitSurface limit = Limit(refinement, mesh().vertices, 2);
  ControlMesh fine = {oracle[2].positions, refinement.levels[2].faces};
  if (!refinement.sharp.empty()) {
    for (const SharpEdge& sharp : refinement.sharp.levels[2].edges) {
      const auto ends = refinement.levels[2].edge_vertices.col(sharp.edge);
      fine.creases.push_back({ends[0], ends[1], sharp.sharpness});
    }
  }
  testing::SortCreases(fine);
  fine.corners = mesh().corners;
  const LimitSurface fine_limit = Limit(Refine(fine, 0), fine.vertices, 0);
  EXPECT_LT(MaxDifference(limit.positions, fine_limit.positions), 1e-12);
  const std::vector<VertexKind> kinds = SettledKinds(mesh());
  for (int v = 0; v < limit.normals.cols(); ++v) {
    // The normals of corners are taken where the vertex is born, see crease_masks.h.
    if (v < static_cast<int>(kinds.size()) && kinds[v] == VertexKind::kCorner) continue;
    EXPECT_LT((limit.normals.col(v) - fine_limit.normals.col(v)).norm(), 1e-8) << v;
  }
}

TEST_P(CreaseOracleTest, NormalsAreOpenSubdivs) {
  const LoopRefinement refinement = Refine(mesh(), kSettled);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh(), refinement);
  const std::vector<VertexKind> kinds = SettledKinds(mesh());
  const LimitSurface limit = Limit(refinement, mesh().vertices, kSettled);
  const auto sectors = SectorsOfLevel(refinement, kSettled);
  ASSERT_TRUE(sectors.ok());
  ASSERT_EQ(sectors->size(), limit.sector_normals.cols());
  // Distance of OpenSubdiv's normal, which is that of one side, to the nearest side of a crease;
  // no entry where a side has a mask of its own (more than three faces, see loop_masks.h).
  std::map<int, double> nearest;
  for (int s = 0; s < sectors->size(); ++s) {
    const int v = sectors->vertices[s];
    const double distance =
        (limit.sector_normals.col(s) - oracle[kSettled].limit_normals.col(v)).norm();
    const bool regular = sectors->begin[s + 1] - sectors->begin[s] <= 3;
    const auto [entry, first] = nearest.try_emplace(v, regular ? distance : -1.0);
    if (!first) entry->second = regular ? std::min(entry->second, distance) : -1.0;
  }
  const MeshTopology& topology = refinement.levels[kSettled];
  int smooth = 0, creases = 0;
  for (int v = 0; v < limit.normals.cols(); ++v) {
    const bool control = v < static_cast<int>(kinds.size());
    if (control && (kinds[v] == VertexKind::kDart || kinds[v] == VertexKind::kCorner)) continue;
    if (const auto crease = nearest.find(v); crease != nearest.end()) {
      EXPECT_LT(crease->second, 1e-9) << v;
      creases += crease->second >= 0.0;
    } else if (!topology.boundary_vertex[v] || topology.valence[v] <= 4) {
      EXPECT_LT((limit.normals.col(v) - oracle[kSettled].limit_normals.col(v)).norm(), 1e-9) << v;
      ++smooth;
    }
  }
  EXPECT_GT(smooth, 100);
  const bool sharp = std::any_of(mesh().creases.begin(), mesh().creases.end(),
                                 [](const Crease& c) { return c.sharpness >= kInfiniteSharpness; });
  EXPECT_EQ(creases > 50, sharp);
}

TEST_P(CreaseOracleTest, AVertexHasOneLimitOnEveryLevel) {
  const LoopRefinement refinement = Refine(mesh(), 3);
  const LimitSurface fine = Limit(refinement, mesh().vertices, 3);
  for (int level = 0; level < 3; ++level) {
    const LimitSurface coarse = Limit(refinement, mesh().vertices, level);
    EXPECT_EQ(coarse.positions, fine.positions.leftCols(coarse.positions.cols()));
    EXPECT_EQ(coarse.normals, fine.normals.leftCols(coarse.normals.cols()));
    EXPECT_EQ(coarse.sector_normals, fine.sector_normals.leftCols(coarse.sector_normals.cols()));
  }
  const LimitSurface lean = Limit(Refine(mesh(), 2), mesh().vertices, 3);
  EXPECT_EQ(lean.positions, fine.positions);
  EXPECT_EQ(lean.normals, fine.normals);
  EXPECT_EQ(lean.sector_normals, fine.sector_normals);
}

TEST_P(CreaseOracleTest, SameForAnyThreadCount) {
  RunContext two;
  two.threads = 2;
  const auto refinement = RefineTopology(mesh(), 3, two);
  ASSERT_TRUE(refinement.ok());
  const auto limit = EvaluateLimit(*refinement, mesh().vertices, 3, two);
  ASSERT_TRUE(limit.ok());
  const LimitSurface one = Limit(Refine(mesh(), 3), mesh().vertices, 3);
  EXPECT_EQ(limit->positions, one.positions);
  EXPECT_EQ(limit->normals, one.normals);
  EXPECT_EQ(limit->sector_normals, one.sector_normals);
}

INSTANTIATE_TEST_SUITE_P(Meshes, CreaseOracleTest, ::testing::ValuesIn(testing::CreaseMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

TEST(CreaseOracleSharpnessTest, HighSharpnessSettlesLate) {
  testing::Random random(31);
  for (const float sharpness : {3.2f, 4.0f, 5.6f}) {
    const ControlMesh mesh = testing::PoleWithSpokes(5, {0, 1, 3}, sharpness, random);
    const int settled = static_cast<int>(std::ceil(sharpness));
    const LoopRefinement refinement = Refine(mesh, settled);
    const auto oracle = testing::EvaluateWithOpenSubdiv(mesh, refinement);
    const LimitSurface limit = Limit(refinement, mesh.vertices, settled);
    EXPECT_LT(MaxDifference(limit.positions, oracle.back().limit_positions), 1e-11) << sharpness;
    EXPECT_LT(MaxDifference(limit.normals, oracle.back().limit_normals), 1e-9) << sharpness;
    EXPECT_EQ(limit.sector_normals.cols(), 0);
  }
}

// OpenSubdiv's points themselves tend to our dart limit, and to no other: its smooth mask at level
// 0 is some way off.
TEST(CreaseOracleDartTest, OpenSubdivTendsToTheDartLimit) {
  testing::Random random(32);
  for (const int valence : {3, 5, 6, 9}) {
    const ControlMesh mesh = testing::PoleWithSpokes(valence, {1}, kInfiniteSharpness, random);
    const LoopRefinement refinement = Refine(mesh, 6);
    const auto oracle = testing::EvaluateWithOpenSubdiv(mesh, refinement);
    const Eigen::Vector3d limit = Limit(refinement, mesh.vertices, 0).positions.col(0);
    for (int level = 0; level < 6; ++level) {
      EXPECT_LT((oracle[level + 1].limit_positions.col(0) - limit).norm(),
                0.62 * (oracle[level].limit_positions.col(0) - limit).norm())
          << valence;
    }
    EXPECT_GT((oracle[0].limit_positions.col(0) - limit).norm(), 1e-3) << valence;
  }
}

}  // namespace
}  // namespace rilievo
