#include "core/loop/patch_lattice.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/loop/refinement.h"
#include "tests/unit/loop/loop_meshes.h"

namespace rilievo {
namespace {

TEST(PatchLatticeTest, TurningThreeTimesChangesNothing) {
  const PatchLattice lattice(3);
  for (int point = 0; point < lattice.point_count(); ++point) {
    EXPECT_EQ(lattice.Turned(0)[static_cast<size_t>(point)], point);
    EXPECT_EQ(lattice.Turned(1)[static_cast<size_t>(lattice.Turned(2)[static_cast<size_t>(point)])],
              point);
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(lattice.Turned(1)[static_cast<size_t>(lattice.corners()[k])],
              lattice.corners()[(k + 1) % 3]);
    for (size_t i = 0; i < 7; ++i) {
      EXPECT_EQ(lattice.Turned(1)[static_cast<size_t>(lattice.sides()[k][i])],
                lattice.sides()[(k + 1) % 3][i]);
    }
  }
}

TEST(PatchLatticeTest, EveryPointIsAddedOnce) {
  for (int steps = 1; steps <= 4; ++steps) {
    const PatchLattice lattice(steps);
    for (int mask = 0; mask < 8; ++mask) {
      std::vector<int> points;
      for (int step = 0; step < steps; ++step) {
        const auto& added = lattice.Added(mask, step);
        points.insert(points.end(), added.begin(), added.end());
      }
      std::vector<int> expected = lattice.interior();
      for (int side = 0; side < 3; ++side) {
        if ((mask >> side & 1) == 0) continue;
        expected.insert(expected.end(), lattice.sides()[side].begin(), lattice.sides()[side].end());
      }
      std::sort(points.begin(), points.end());
      std::sort(expected.begin(), expected.end());
      EXPECT_EQ(points, expected) << steps << " " << mask;
    }
  }
}

class PatchNumberingTest : public ::testing::TestWithParam<testing::NamedMesh> {};

// The lattice's triangles, with the vertices of the numbering, are the refinement's.
TEST_P(PatchNumberingTest, IsThatOfTheRefinement) {
  const ControlMesh& mesh = GetParam().mesh;
  for (int steps = 1; steps <= 3; ++steps) {
    const auto refinement = RefineTopology(mesh, steps + 1, RunContext());
    const PatchLattice lattice(steps);
    const PatchNumbering numbering(refinement->levels[1], lattice);
    EXPECT_EQ(numbering.vertex_count(), refinement->levels.back().vertex_count);
    std::vector<int> vertices;
    Eigen::Matrix3Xi faces(3, refinement->levels.back().face_count());
    const Eigen::Index per_face = lattice.triangles().cols();
    for (int f = 0; f < refinement->levels[1].face_count(); ++f) {
      numbering.VerticesOf(f, vertices);
      for (Eigen::Index t = 0; t < per_face; ++t) {
        for (int k = 0; k < 3; ++k) {
          faces(k, f * per_face + t) = vertices[static_cast<size_t>(lattice.triangles()(k, t))];
        }
      }
    }
    EXPECT_EQ(faces, refinement->levels.back().faces);
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, PatchNumberingTest, ::testing::ValuesIn(testing::LoopMeshes()),
                         [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace rilievo
