#include "core/loop/refinement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/geometry/test_meshes.h"
#include "tests/unit/loop/loop_meshes.h"
#include "tests/unit/loop/opensubdiv_oracle.h"

namespace rilievo {
namespace {

using testing::Refine;

void ExpectEqual(const MeshTopology& a, const MeshTopology& b) {
  EXPECT_EQ(a.vertex_count, b.vertex_count);
  EXPECT_EQ(a.faces, b.faces);
  EXPECT_EQ(a.face_edges, b.face_edges);
  EXPECT_EQ(a.face_neighbors, b.face_neighbors);
  EXPECT_EQ(a.edge_vertices, b.edge_vertices);
  EXPECT_EQ(a.edge_faces, b.edge_faces);
  EXPECT_EQ(a.boundary_vertex, b.boundary_vertex);
  EXPECT_EQ(a.valence, b.valence);
}

class LoopMeshTest : public ::testing::TestWithParam<testing::NamedMesh> {};

TEST_P(LoopMeshTest, EveryLevelIsWhatItsFacesSay) {
  const LoopRefinement refinement = Refine(GetParam().mesh, 3);
  ASSERT_EQ(refinement.max_level(), 3);
  for (const MeshTopology& level : refinement.levels) {
    const auto rebuilt = BuildMeshTopology(level.faces, level.vertex_count);
    ASSERT_TRUE(rebuilt.ok()) << rebuilt.status();
    ExpectEqual(level, *rebuilt);
  }
}

TEST_P(LoopMeshTest, NumbersNestAsStated) {
  const LoopRefinement refinement = Refine(GetParam().mesh, 2);
  for (int l = 0; l < 2; ++l) {
    const MeshTopology& level = refinement.levels[l];
    const MeshTopology& next = refinement.levels[l + 1];
    EXPECT_EQ(next.vertex_count, level.vertex_count + level.edge_count());
    for (int f = 0; f < level.face_count(); ++f) {
      const Eigen::Vector3i v = level.faces.col(f);
      const Eigen::Vector3i m = level.face_edges.col(f).array() + level.vertex_count;
      EXPECT_EQ(Eigen::Vector3i(next.faces.col(4 * f)), Eigen::Vector3i(v[0], m[0], m[2]));
      EXPECT_EQ(Eigen::Vector3i(next.faces.col(4 * f + 1)), Eigen::Vector3i(m[0], v[1], m[1]));
      EXPECT_EQ(Eigen::Vector3i(next.faces.col(4 * f + 2)), Eigen::Vector3i(m[2], m[1], v[2]));
      EXPECT_EQ(Eigen::Vector3i(next.faces.col(4 * f + 3)), Eigen::Vector3i(m[1], m[2], m[0]));
    }
    EXPECT_EQ(RefineFaces(level), next.faces);
    for (const bool vertices_alone : {false, true}) {
      LoopRefinement to_next;
      to_next.levels.assign(refinement.levels.begin(), refinement.levels.begin() + l + 1);
      EXPECT_EQ(FinestFaces(to_next), level.faces);
      to_next.levels.push_back(vertices_alone ? VerticesAfter(level) : next);
      EXPECT_EQ(FinestFaces(to_next), next.faces);
    }
    EXPECT_EQ(refinement.vertex_count(l + 1), next.vertex_count);
  }
}

TEST_P(LoopMeshTest, CountsTheVerticesOfTheNextLevel) {
  EXPECT_EQ(Refine(GetParam().mesh, 1).vertex_count(2),
            Refine(GetParam().mesh, 2).levels[2].vertex_count);
}

TEST_P(LoopMeshTest, RefinementKeepsTheTopology) {
  const LoopRefinement refinement = Refine(GetParam().mesh, 3);
  const MeshTopology& coarse = refinement.levels.front();
  const MeshTopology& fine = refinement.levels.back();
  const TopologySummary before = SummarizeTopology(coarse.faces, coarse.vertex_count);
  const TopologySummary after = SummarizeTopology(fine.faces, fine.vertex_count);
  EXPECT_EQ(after.euler, before.euler);
  EXPECT_EQ(after.genus, before.genus);
  EXPECT_EQ(after.components, before.components);
  EXPECT_EQ(after.boundary_loops, before.boundary_loops);
  EXPECT_EQ(after.boundary_edges, 8 * before.boundary_edges);
  EXPECT_TRUE(after.manifold());
}

TEST_P(LoopMeshTest, PositionsAgreeWithOpenSubdivOnEveryLevel) {
  const ControlMesh& mesh = GetParam().mesh;
  const LoopRefinement refinement = Refine(mesh, 4);
  const auto oracle = testing::EvaluateWithOpenSubdiv(mesh, refinement);
  Eigen::Matrix3Xd positions = mesh.vertices;
  for (int level = 0; level <= 4; ++level) {
    const double scale = mesh.vertices.cwiseAbs().maxCoeff();
    EXPECT_LT((positions - oracle[level].positions).cwiseAbs().maxCoeff(), 1e-13 * scale) << level;
    if (level < 4) positions = SubdivideOnce(refinement, level, positions);
  }
}

TEST_P(LoopMeshTest, SameForAnyThreadCount) {
  const LoopRefinement one = Refine(GetParam().mesh, 3, 1), two = Refine(GetParam().mesh, 3, 2);
  for (int level = 0; level <= 3; ++level) ExpectEqual(one.levels[level], two.levels[level]);
}

INSTANTIATE_TEST_SUITE_P(Meshes, LoopMeshTest, ::testing::ValuesIn(testing::LoopMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

TEST(RefineTopologyTest, SameForAnyThreadCountOverManyBlocks) {
  const ControlMesh mesh = testing::Torus(60, 40);
  const LoopRefinement one = Refine(mesh, 3, 1), two = Refine(mesh, 3, 2);
  ExpectEqual(one.levels.back(), two.levels.back());
}

TEST(RefineTopologyTest, RefusesWhatItCannotRefine) {
  const RunContext context;
  const ControlMesh mesh = testing::Icosahedron();
  EXPECT_EQ(RefineTopology(mesh, -1, context).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(RefineTopology(mesh, kMaxLoopLevel + 1, context).status().code(),
            absl::StatusCode::kInvalidArgument);
  // 20 000 faces at level 8: 1.3e9.
  EXPECT_EQ(RefineTopology(testing::Torus(100, 100), 8, context).status().code(),
            absl::StatusCode::kResourceExhausted);
  ControlMesh flipped = mesh;
  std::swap(flipped.faces(0, 3), flipped.faces(1, 3));
  const auto refused = RefineTopology(flipped, 2, context).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(refused.message()), ::testing::HasSubstr("same direction"));
}

TEST(RefineTopologyTest, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(RefineTopology(testing::Icosahedron(), 2, context).status().code(),
            absl::StatusCode::kCancelled);
}

TEST(SubdivideOnceTest, CommutesWithAffineMaps) {
  testing::Random random(6);
  const ControlMesh mesh = testing::Perturbed(testing::Grid(5, 4), 0.3, random);
  const LoopRefinement refinement = Refine(mesh, 1);
  Eigen::Matrix3d linear;
  for (int i = 0; i < 9; ++i) linear.data()[i] = random.Signed();
  const Eigen::Vector3d offset = 10.0 * random.Vector();
  const Eigen::Matrix3Xd moved = (linear * mesh.vertices).colwise() + offset;
  const Eigen::Matrix3Xd expected =
      (linear * SubdivideOnce(refinement, 0, mesh.vertices)).colwise() + offset;
  EXPECT_LT((SubdivideOnce(refinement, 0, moved) - expected).cwiseAbs().maxCoeff(), 1e-13);
}

}  // namespace
}  // namespace rilievo
