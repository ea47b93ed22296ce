#include "core/control/implicit/marching_cubes_transition.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <functional>
#include <set>
#include <tuple>

namespace rilievo {
namespace {

using Eigen::Vector3d, Eigen::Vector3i;

// 2 x 2 x 2 cells of size 1, of which that at the origin is cut into eight.
std::vector<GridLevel> TwoSizes(const std::function<double(const Vector3d&)>& field) {
  std::vector<GridLevel> levels(1);
  levels[0].cell = 1;
  levels[0].grid.AddBox({0, 0, 0}, {2, 2, 2});
  levels[0].grid.Seal();
  levels[0].values.assign(levels[0].grid.size(), 0.0f);
  SparseGrid cut;
  cut.AddBox({0, 0, 0}, {0, 0, 0});
  cut.Seal();
  levels.push_back(RefineCells(levels[0], cut, RunContext{}).value());
  for (GridLevel& level : levels) {
    const std::vector<Vector3i> nodes = level.grid.Nodes();
    for (size_t n = 0; n < nodes.size(); ++n) {
      level.values[n] = static_cast<float>(field(level.cell * nodes[n].cast<double>()));
    }
  }
  return levels;
}

FinerNodes FinerNodesIn(const SparseGrid& next, const Vector3i& cell) {
  FinerNodes finer;
  SparseGridReader(next).FindThreeCubed(2 * cell, &finer);
  return finer;
}

EdgeLoops LoopsOf(const std::vector<GridLevel>& levels, const Vector3i& cell) {
  std::array<int, 8> corners;
  EXPECT_TRUE(levels[0].grid.FindCell(cell, &corners));
  return LoopsOfTransitionCell(levels, 0, corners, FinerNodesIn(levels[1].grid, cell));
}

// Each edge of a loop is crossed, and none is named twice.
void ExpectCrossedOnce(const std::vector<GridLevel>& levels, const EdgeLoops& loops) {
  std::set<std::tuple<int, int, int>> seen;
  for (const auto& loop : loops) {
    for (const GridEdge& edge : loop) {
      const GridLevel& level = levels[edge.level];
      EXPECT_NE(level.values[edge.node] < 0, level.values[edge.next] < 0);
      const Vector3i way = level.grid.Nodes()[edge.next] - level.grid.Nodes()[edge.node];
      EXPECT_EQ(way, Vector3i::Unit(edge.axis));
      EXPECT_TRUE(seen.emplace(edge.level, edge.node, edge.axis).second);
    }
  }
}

TEST(IsoTransitionTest, CellsThatShareAFaceOrAnEdgeTouchTheSmallerOnes) {
  const auto levels = TwoSizes([](const Vector3d&) { return 1.0; });
  EXPECT_TRUE(TouchesSmallerCells(FinerNodesIn(levels[1].grid, {1, 0, 0})));
  EXPECT_TRUE(TouchesSmallerCells(FinerNodesIn(levels[1].grid, {1, 1, 0})));
  EXPECT_FALSE(
      TouchesSmallerCells(FinerNodesIn(levels[1].grid, {1, 1, 1})));  // a corner is cut by nothing
}

TEST(IsoTransitionTest, APlaneBesideTheSmallerCellsCrossesWholeEdgesAlone) {
  const auto levels = TwoSizes([](const Vector3d& p) { return p.x() - 1.6; });
  const EdgeLoops loops = LoopsOf(levels, {1, 0, 0});
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0].size(), 4u);
  for (const GridEdge& edge : loops[0]) {
    EXPECT_EQ(edge.level, 0);
    EXPECT_EQ(edge.axis, 0);
  }
  ExpectCrossedOnce(levels, loops);
}

// On the face that is shared it crosses three edges of the smaller cells, on the far one two.
TEST(IsoTransitionTest, APlaneIntoTheSmallerCellsMeetsTheirEdges) {
  const auto levels = TwoSizes([](const Vector3d& p) { return p.y() - 0.3; });
  const EdgeLoops loops = LoopsOf(levels, {1, 0, 0});
  ASSERT_EQ(loops.size(), 1u);
  const auto fine = std::count_if(loops[0].begin(), loops[0].end(),
                                  [](const GridEdge& edge) { return edge.level == 1; });
  EXPECT_EQ(fine, 3);
  EXPECT_EQ(loops[0].size(), 5u);
  ExpectCrossedOnce(levels, loops);
}

// Seen from the negative side the loop runs counter-clockwise: its area vector points there.
TEST(IsoTransitionTest, LoopsTurnCounterClockwiseSeenFromTheNegativeSide) {
  for (const double sign : {-1.0, 1.0}) {
    const auto levels = TwoSizes([&](const Vector3d& p) { return sign * (p.y() - 0.3); });
    const EdgeLoops loops = LoopsOf(levels, {1, 0, 0});
    ASSERT_EQ(loops.size(), 1u);
    std::vector<Vector3d> at;
    for (const GridEdge& edge : loops[0]) {
      const GridLevel& level = levels[edge.level];
      const std::vector<Vector3i> nodes = level.grid.Nodes();
      at.push_back(level.cell / 2 * (nodes[edge.node] + nodes[edge.next]).cast<double>());
    }
    Vector3d area = Vector3d::Zero();
    for (size_t k = 1; k + 1 < at.size(); ++k) area += (at[k] - at[0]).cross(at[k + 1] - at[0]);
    EXPECT_LT(sign * area.y(), 0);
  }
}

TEST(IsoTransitionTest, WhereNothingChangesSignThereIsNoLoop) {
  EXPECT_TRUE(LoopsOf(TwoSizes([](const Vector3d&) { return 1.0; }), {1, 0, 0}).empty());
}

}  // namespace
}  // namespace rilievo
