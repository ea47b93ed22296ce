#include "core/loop/patch_table.h"

#include <gtest/gtest.h>

#include <set>

#include "core/loop/refinement.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

TEST(PatchRingTest, IsTheVerticesAroundAFaceCounterClockwise) {
  // Vertex 5 of a torus of 8 by 6 has the regular ring.
  const ControlMesh mesh = testing::Torus(8, 6);
  const auto topology = BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  const VertexRings rings = BuildVertexRings(*topology);
  std::vector<int> ring;
  for (int first = 0; first < 3; ++first) {
    PatchRing(*topology, 20, first, ring);
    ASSERT_EQ(ring.size(), 12u);
    std::set<int> expected;
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(ring[static_cast<size_t>(k)], topology->faces((first + k) % 3, 20));
      const int v = topology->faces(k, 20);
      expected.insert(&rings.neighbors[static_cast<size_t>(rings.neighbor_begin[v])],
                      &rings.neighbors[static_cast<size_t>(rings.neighbor_begin[v])] + 6);
    }
    EXPECT_EQ(std::set<int>(ring.begin(), ring.end()), expected);
    // Successive outer vertices are neighbours.
    for (size_t i = 3; i < 12; ++i) {
      const int a = ring[i], b = ring[i + 1 < 12 ? i + 1 : 3];
      const int* const begin = &rings.neighbors[static_cast<size_t>(rings.neighbor_begin[a])];
      EXPECT_NE(std::find(begin, begin + 6, b), begin + 6) << i;
    }
  }
}

// Weights of positions sum to one, of tangents to zero; so a shift moves the points alone.
TEST(PatchTableTest, AShiftOfTheRingShiftsThePoints) {
  const PatchLattice lattice(2);
  for (int valence : {3, 5, 6, 9}) {
    const auto table = PatchTable::Build(valence, lattice);
    ASSERT_TRUE(table.ok()) << table.status();
    ASSERT_EQ(table->ring_size(), valence + 6);
    std::vector<std::array<double, 3>> ring(static_cast<size_t>(valence + 6), {3.0, -1.0, 0.5});
    std::vector<PatchSample> samples(static_cast<size_t>(lattice.point_count()));
    for (int group = 0; group < 4; ++group) {
      table->Evaluate(static_cast<PatchTable::Group>(group), ring, samples);
    }
    for (int point = 0; point < lattice.point_count(); ++point) {
      const PatchSample& sample = samples[static_cast<size_t>(point)];
      const auto& corners = lattice.corners();
      if (std::find(corners.begin(), corners.end(), point) != corners.end()) continue;
      EXPECT_NEAR(sample[0], 3.0, 1e-14);
      EXPECT_NEAR(sample[1], -1.0, 1e-14);
      EXPECT_NEAR(sample[2], 0.5, 1e-14);
      for (size_t i = 3; i < 9; ++i) EXPECT_NEAR(sample[i], 0.0, 1e-14);
    }
  }
}

}  // namespace
}  // namespace rilievo
