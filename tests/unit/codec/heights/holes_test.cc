#include "core/codec/heights/holes.h"

#include <algorithm>

#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

int Count(const std::vector<uint8_t>& flags) {
  return static_cast<int>(std::count(flags.begin(), flags.end(), 1));
}

TEST(HolesTest, KeepsPatchesOfTheGivenSize) {
  constexpr int kLevel = 3;
  const LoopRefinement refinement = *RefineTopology(Torus(8, 6), kLevel, RunContext());
  const MeshTopology& finest = refinement.levels[kLevel];
  const VertexRings rings = BuildVertexRings(finest);
  // One vertex alone, and one far away with its ring of six.
  std::vector<uint8_t> filled(finest.vertex_count, 0);
  filled[10] = 1;
  const int center = finest.vertex_count - 1;
  filled[center] = 1;
  for (int i = rings.neighbor_begin[center]; i < rings.neighbor_begin[center + 1]; ++i) {
    filled[rings.neighbors[i]] = 1;
  }
  ASSERT_EQ(Count(filled), 8);
  for (const auto& [smallest, left] : {std::pair(1, 8), {2, 7}, {7, 7}, {8, 0}}) {
    std::vector<uint8_t> flags = filled;
    DropSmallHoles(refinement, kLevel, smallest, flags);
    EXPECT_EQ(Count(flags), left) << smallest;
    EXPECT_EQ(flags[10], smallest == 1);
  }
}

// Around the one vertex that is not filled, of six neighbours as those near it: 6, 12, 18.
TEST(HolesTest, CountsRingsIntoHoles) {
  constexpr int kLevel = 3;
  const LoopRefinement refinement = *RefineTopology(Torus(8, 6), kLevel - 1, RunContext());
  std::vector<uint8_t> filled(refinement.vertex_count(kLevel), 1);
  filled.back() = 0;
  const auto all = static_cast<std::ptrdiff_t>(filled.size());
  const std::vector<uint8_t> rings = RingsIntoHoles(refinement, kLevel, 3, filled);
  for (const auto& [ring, count] :
       {std::pair<int, std::ptrdiff_t>(0, 1), {1, 6}, {2, 12}, {3, 18}, {4, all - 37}}) {
    EXPECT_EQ(std::count(rings.begin(), rings.end(), ring), count) << ring;
  }
  filled.back() = 1;
  EXPECT_EQ(RingsIntoHoles(refinement, kLevel, 1, filled), std::vector<uint8_t>(filled.size(), 2));
  const LoopRefinement control = *RefineTopology(Octahedron(), 0, RunContext());
  EXPECT_EQ(RingsIntoHoles(control, 0, 3, {1, 0, 1, 1, 1, 1}),
            (std::vector<uint8_t>{2, 0, 1, 1, 1, 1}));
}

TEST(HolesTest, WorksOnTheControlMeshAlone) {
  const LoopRefinement refinement = *RefineTopology(Octahedron(), 0, RunContext());
  std::vector<uint8_t> flags = {1, 0, 0, 0, 1, 0};  // neighbours
  DropSmallHoles(refinement, 0, 2, flags);
  EXPECT_EQ(Count(flags), 2);
  flags = {1, 1, 0, 0, 0, 0};  // opposite corners
  DropSmallHoles(refinement, 0, 2, flags);
  EXPECT_EQ(Count(flags), 0);
}

// A scattered flag is nothing, the border between two kinds stays.
TEST(HolesTest, SmallPatchesOfSmoothedHeightsTakeOnWhatIsAround) {
  constexpr int kLevel = 3, kSmallest = 16;
  const DisplacedSurface surface = SurfaceOver(Torus(10, 8), kLevel, 4e-4, 0);
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, kLevel, RunContext());
  std::vector<uint8_t> filled, smoothed;
  for (HeightSource source : surface.sources) {
    filled.push_back(source == HeightSource::kFilled);
    smoothed.push_back(source == HeightSource::kSmoothed);
  }
  std::vector<uint8_t> clean = smoothed;
  DropSmallPatches(refinement, kLevel, kSmallest, filled, clean);
  EXPECT_LT(Count(clean), Count(smoothed));
  EXPECT_GT(Count(clean), Count(smoothed) * 8 / 10);
  int checked = 0;
  for (size_t v = 0; v < clean.size(); v += 101) {
    if (filled[v] != 0) continue;
    std::vector<uint8_t> turned = clean;
    turned[v] ^= 1;
    DropSmallPatches(refinement, kLevel, kSmallest, filled, turned);
    checked += turned == clean;
    for (size_t u = 0; u < turned.size(); ++u) ASSERT_EQ(turned[u] & filled[u], 0);
  }
  EXPECT_GT(checked, 20);
}

}  // namespace
}  // namespace rilievo
