#include "core/displacement/plate/plate_levels.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/displacement/domain_fixtures.h"

namespace rilievo {
namespace {

using namespace testing;

std::vector<PlateLevel> Levels(const Domain& domain) {
  return *BuildPlateLevels(domain.refinement, domain.rings, domain.limit, Threads(2));
}

// Heights a + b x + c y, of the vertices of a level.
std::vector<float> Plane(const Domain& domain, int count) {
  std::vector<float> heights(count);
  for (int v = 0; v < count; ++v) {
    heights[v] = 0.1 + 0.3 * domain.limit.positions(0, v) - 0.2 * domain.limit.positions(1, v);
  }
  return heights;
}

TEST(PlateLevels, APlaneDoesNotBendInsideASheet) {
  const Domain domain = MakeDomain(Sheet(0.3, 8), 2);
  const PlateLevel level = Levels(domain).back();
  const std::vector<float> heights = Plane(domain, level.vertex_count());
  const MeshTopology& finest = domain.refinement.levels.back();
  int inside = 0;
  for (int v = 0; v < level.vertex_count(); ++v) {
    // Near the rim the limit positions of a sheet are not even.
    if (domain.limit.positions.col(v).cwiseAbs().maxCoeff() > 0.2 || finest.valence[v] != 6)
      continue;
    EXPECT_NEAR(BendAt(level, heights, v), 0, 1e-6);
    ++inside;
  }
  EXPECT_GT(inside, 100);
}

TEST(PlateLevels, OnARimTheRowGoesAlongIt) {
  const Domain domain = MakeDomain(Sheet(0.3, 4), 1);
  const PlateLevel level = Levels(domain).back();
  const MeshTopology& finest = domain.refinement.levels.back();
  for (int v = 0; v < level.vertex_count(); ++v) {
    if (!finest.boundary_vertex[v]) continue;
    int in_row = 0;
    for (uint32_t s = level.begin[v]; s < level.begin[v + 1]; ++s) {
      if (level.slot[s].InRow() == 0) continue;
      ++in_row;
      EXPECT_TRUE(finest.boundary_vertex[level.neighbor[s]]);
    }
    EXPECT_EQ(in_row, 2);
  }
}

TEST(PlateLevels, AcrossACreaseThereIsNoRowAndAtACornerNone) {
  ControlMesh mesh = Sheet(0.3, 4);
  // The middle column of vertices, x = 0.
  for (int y = 0; y < 4; ++y)
    mesh.creases.push_back({5 * y + 2, 5 * (y + 1) + 2, kInfiniteSharpness});
  const Domain domain = MakeDomain(mesh, 2);
  const PlateLevel level = Levels(domain).back();
  const MeshTopology& finest = domain.refinement.levels.back();
  int on_crease = 0;
  for (int v = 0; v < level.vertex_count(); ++v) {
    if (std::abs(domain.limit.positions(0, v)) > 1e-9 || finest.boundary_vertex[v]) continue;
    ++on_crease;
    for (uint32_t s = level.begin[v]; s < level.begin[v + 1]; ++s) {
      const bool along = std::abs(domain.limit.positions(0, level.neighbor[s])) < 1e-9;
      EXPECT_EQ(level.slot[s].InRow() != 0, along);
    }
  }
  EXPECT_GT(on_crease, 8);
}

// Two creases leave a corner along two sides of one face, so that the vertices next to the corner
// are neighbours of each other.
TEST(PlateLevels, NextToACornerTheRowGoesAlongItsOwnCrease) {
  ControlMesh mesh = Sheet(0.3, 4);
  mesh.creases = {{7, 12, kInfiniteSharpness},
                  {11, 12, kInfiniteSharpness},
                  {12, 13, kInfiniteSharpness},
                  {12, 17, kInfiniteSharpness},
                  {12, 18, kInfiniteSharpness}};
  constexpr int kCorner = 12;
  const Domain domain = MakeDomain(mesh, 3);
  const std::vector<PlateLevel> levels = Levels(domain);
  for (size_t l = 2; l < levels.size(); ++l) {  // the creases are an edge long
    const PlateLevel& level = levels[l];
    EXPECT_EQ(level.row_size[kCorner], 0) << l;
    int on_crease = 0;
    for (uint32_t s = level.begin[kCorner]; s < level.begin[kCorner + 1]; ++s) {
      const int next = level.neighbor[s];
      if (level.row_size[next] != 2) continue;
      ++on_crease;
      EXPECT_NE(level.slot[s].InOtherRow(), 0) << l;
    }
    EXPECT_EQ(on_crease, 5) << l;
  }
}

TEST(PlateLevels, RestrictIsTheTransposeOfProlong) {
  const Domain domain = MakeDomain(Octahedron(0.3, 1), 3);
  Random random(1);
  const auto numbers = [&](int level) {
    std::vector<float> list(domain.refinement.levels[level].vertex_count);
    for (float& x : list) x = static_cast<float>(Uniform(&random, -1, 1));
    return list;
  };
  const auto dot = [](const std::vector<float>& a, const std::vector<float>& b) {
    double sum = 0;
    for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
    return sum;
  };
  const std::vector<float> coarse = numbers(1), fine = numbers(3);
  EXPECT_NEAR(dot(Prolong(domain.refinement, 1, 3, coarse), fine),
              dot(coarse, Restrict(domain.refinement, 3, 1, fine)), 1e-5);
}

}  // namespace
}  // namespace rilievo
