#include "core/loop/split_normals.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <set>

#include "core/geometry/half_edges.h"
#include "tests/unit/loop/crease_meshes.h"

namespace rilievo {
namespace {

using testing::Refine;

class SplitNormalsTest : public ::testing::TestWithParam<testing::NamedMesh> {
 protected:
  const ControlMesh& mesh() const { return GetParam().mesh; }
};

// The sides found by walking over the level itself: corners at a vertex belong together when an
// edge between them is not sharp for ever.
TEST_P(SplitNormalsTest, SectorsAreTheFacesBetweenSharpEdges) {
  const LoopRefinement refinement = Refine(mesh(), 3);
  for (int level = 0; level <= 3; ++level) {
    const MeshTopology& topology = refinement.levels[level];
    const auto sectors = SectorsOfLevel(refinement, level);
    ASSERT_TRUE(sectors.ok());
    std::set<int> sharp_edges;
    if (!refinement.sharp.empty()) {
      for (const SharpEdge& sharp : refinement.sharp.levels[level].edges) {
        if (sharp.sharpness >= kInfiniteSharpness) sharp_edges.insert(sharp.edge);
      }
    }
    const VertexRings rings = BuildVertexRings(topology);
    std::map<int, size_t> corners_at;
    for (int s = 0; s < sectors->size(); ++s) {
      const int v = sectors->vertices[s];
      corners_at[v] += sectors->begin[s + 1] - sectors->begin[s];
      ASSERT_LT(sectors->begin[s], sectors->begin[s + 1]);
      const auto is_side = [&](uint32_t h) {
        return topology.face_neighbors.data()[h] < 0 ||
               sharp_edges.contains(topology.face_edges.data()[h]);
      };
      for (int i = sectors->begin[s]; i < sectors->begin[s + 1]; ++i) {
        const uint32_t h = sectors->half_edges[i];
        EXPECT_EQ(Origin(topology.faces, h), v);
        EXPECT_EQ(is_side(h), i == sectors->begin[s]);
        const bool last = i + 1 == sectors->begin[s + 1];
        EXPECT_EQ(is_side(PreviousHalfEdge(h)), last);
        if (!last) {
          EXPECT_EQ(topology.face_neighbors.data()[PreviousHalfEdge(h)],
                    static_cast<int>(sectors->half_edges[i + 1] / 3));
        }
      }
    }
    for (const auto& [v, corners] : corners_at) {
      EXPECT_EQ(corners, static_cast<size_t>(topology.valence[v] - topology.boundary_vertex[v]));
    }
    // Every vertex with two sharp edges, one of them inside, is there.
    std::map<int, int> sharp_count;
    for (int e : sharp_edges) {
      for (int end = 0; end < 2; ++end) ++sharp_count[topology.edge_vertices(end, e)];
    }
    for (const auto& [v, count] : sharp_count) {
      EXPECT_EQ(corners_at.contains(v), count + 2 * topology.boundary_vertex[v] >= 2) << v;
    }
    EXPECT_TRUE(std::is_sorted(sectors->vertices.begin(), sectors->vertices.end()));
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, SplitNormalsTest, ::testing::ValuesIn(testing::CreaseMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

TEST(SectorsOfLevelTest, NormalsAreThoseOfTheFacesAround) {
  const ControlMesh cube = testing::SharpCube();
  const LoopRefinement refinement = Refine(cube, 2);
  for (int level = 0; level <= 3; ++level) {
    const auto sectors = SectorsOfLevel(refinement, level);
    const auto limit = EvaluateLimit(refinement, cube.vertices, level, RunContext());
    ASSERT_TRUE(sectors.ok() && limit.ok());
    ASSERT_EQ(sectors->size(), limit->sector_normals.cols());
    // Eight corners of three sides, and two for each vertex inside the twelve edges.
    EXPECT_EQ(sectors->size(), 24 + 2 * 12 * ((1 << level) - 1));
    const Eigen::Matrix3Xi faces =
        level <= 2 ? refinement.levels[level].faces : RefineFaces(refinement.levels[2]);
    for (int s = 0; s < sectors->size(); ++s) {
      for (int i = sectors->begin[s]; i < sectors->begin[s + 1]; ++i) {
        const Eigen::Vector3i face = faces.col(sectors->half_edges[i] / 3);
        const Eigen::Vector3d a = limit->positions.col(face[0]);
        const Eigen::Vector3d normal = (limit->positions.col(face[1]) - a)
                                           .cross(limit->positions.col(face[2]) - a)
                                           .normalized();
        EXPECT_LT((limit->sector_normals.col(s) - normal).norm(), 1e-12);
      }
    }
  }
}

TEST(SectorsOfLevelTest, RefusesLevelsThatAreNotThere) {
  const LoopRefinement refinement = Refine(testing::SharpCube(), 1);
  for (const int level : {-1, 3}) {
    EXPECT_EQ(SectorsOfLevel(refinement, level).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace rilievo
