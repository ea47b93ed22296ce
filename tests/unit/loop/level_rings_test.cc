#include "core/loop/level_rings.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/loop/refinement.h"
#include "tests/unit/loop/loop_meshes.h"

namespace rilievo {
namespace {

class LevelRingsTest : public ::testing::TestWithParam<testing::NamedMesh> {};

TEST_P(LevelRingsTest, OfTheLevelBeforeAreThoseOfTheTable) {
  const LoopRefinement refinement = RefineTopology(GetParam().mesh, 3, RunContext()).value();
  for (int level = 1; level <= 3; ++level) {
    const VertexRings table = BuildVertexRings(refinement.levels[level]);
    const LevelRings stored(table), made = LevelRings::After(refinement.levels[level - 1]);
    for (int v = 0; v < refinement.levels[level].vertex_count; ++v) {
      const Ring expected = stored.Of(v), ring = made.Of(v);
      ASSERT_TRUE(std::equal(ring.begin(), ring.end(), expected.begin(), expected.end()))
          << "level " << level << ", vertex " << v;
    }
  }
}

TEST_P(LevelRingsTest, VerticesAloneAreThoseOfTheWholeLevel) {
  const LoopRefinement refinement = RefineTopology(GetParam().mesh, 2, RunContext()).value();
  for (int level = 1; level <= 2; ++level) {
    const MeshTopology vertices = VerticesAfter(refinement.levels[level - 1]);
    EXPECT_EQ(vertices.vertex_count, refinement.levels[level].vertex_count);
    EXPECT_EQ(vertices.valence, refinement.levels[level].valence);
    EXPECT_EQ(vertices.boundary_vertex, refinement.levels[level].boundary_vertex);
    EXPECT_EQ(vertices.edge_count(), 0);
  }
}

INSTANTIATE_TEST_SUITE_P(All, LevelRingsTest, ::testing::ValuesIn(testing::LoopMeshes()),
                         [](const auto& mesh) { return mesh.param.name; });

}  // namespace
}  // namespace rilievo
