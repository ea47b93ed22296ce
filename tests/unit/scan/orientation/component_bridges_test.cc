#include "core/scan/orientation/component_bridges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/scan/orientation/orient_normals.h"
#include "tests/scans/random.h"

namespace rilievo {
namespace {

// Points of several sheets, one spacing of 1 apart on average; jittered off a grid.
struct Sheets {
  OrientedCloud cloud;
  std::vector<int> component;

  // z = height over the cells of the square [0, side]^2 that `has` accepts, normals up.
  void Add(
      int name, int side, double height,
      const std::function<bool(double, double)>& has = [](double, double) { return true; }) {
    Random random(static_cast<uint64_t>(name) + 1);
    const double cell = std::sqrt(M_PI / 4);  // a point's share of the surface
    for (int i = 0; i < side * side; ++i) {
      const double x = cell * (i % side + random.Uniform()),
                   y = cell * (i / side + random.Uniform());
      if (!has(x, y)) continue;
      const int64_t at = cloud.points.cols();
      cloud.points.conservativeResize(3, at + 1);
      cloud.normals.conservativeResize(3, at + 1);
      cloud.points.col(at) << x, y, height;
      cloud.normals.col(at) << 0, 0, 1;
      cloud.spacing.push_back(1);
      cloud.noise.push_back(0);
      component.push_back(name);
    }
  }
};

// Sums of the weights.
struct Votes {
  double same = 0, opposite = 0;
};
Votes VotesOf(const Sheets& sheets) {
  Votes votes;
  const auto links = BridgeComponents(sheets.cloud, sheets.component, 2, RunContext());
  for (const SignedLink& link : *links) {
    EXPECT_EQ(link.a + link.b, 1);  // components 0 and 1
    (link.weight > 0 ? votes.same : votes.opposite) += std::abs(link.weight);
  }
  return votes;
}

TEST(ComponentBridgesTest, SheetsOverEachOtherHaveOppositeSides) {
  for (const double gap : {0.6, 1.5, 2.5}) {
    Sheets sheets;
    sheets.Add(0, 30, 0);
    sheets.Add(1, 30, gap);
    const Votes up = VotesOf(sheets);
    EXPECT_GT(up.opposite, 0.5 * 900) << gap;
    EXPECT_LT(up.same, 0.02 * up.opposite) << gap;
    sheets.cloud.normals.leftCols(900) *= -1;  // as they should be
    const Votes apart = VotesOf(sheets);
    EXPECT_GT(apart.same, 0.5 * 900) << gap;
    EXPECT_LT(apart.opposite, 0.02 * apart.same) << gap;
  }
}

// More pairs than are asked: those that are speak for the rest.
TEST(ComponentBridgesTest, VotesGrowWithTheSheets) {
  Sheets sheets;
  sheets.Add(0, 80, 0);
  sheets.Add(1, 80, 2);
  EXPECT_GT(VotesOf(sheets).opposite, 0.5 * 6400);
  EXPECT_LT(VotesOf(sheets).opposite, 6400);
}

TEST(ComponentBridgesTest, FloorsOfAStairAreNoWall) {
  Sheets stair;
  stair.Add(0, 40, 0, [](double x, double) { return x < 16; });
  stair.Add(1, 40, 1.5, [](double x, double) { return x >= 16; });
  const Votes votes = VotesOf(stair);
  EXPECT_LT(votes.opposite, 0.1 * 40);  // of 40 points along the edge
}

// All around the plateau, so that only the points near each tell.
TEST(ComponentBridgesTest, APlateauIsNoWall) {
  const auto radius = [](double x, double y) { return std::hypot(x - 18, y - 18); };
  Sheets plateau;
  plateau.Add(0, 40, 0, [&](double x, double y) { return radius(x, y) > 10; });
  plateau.Add(1, 40, 1.5, [&](double x, double y) { return radius(x, y) <= 10; });
  const Votes votes = VotesOf(plateau);
  EXPECT_LT(votes.opposite, 0.1 * 2 * M_PI * 10);
}

TEST(ComponentBridgesTest, AcrossASlitASheetGoesOn) {
  Sheets sheets;
  sheets.Add(0, 40, 0, [](double x, double) { return x < 15; });
  sheets.Add(1, 40, 0, [](double x, double) { return x > 16.5; });
  const Votes votes = VotesOf(sheets);
  EXPECT_GT(votes.same, 40);
  EXPECT_EQ(votes.opposite, 0);
}

TEST(ComponentBridgesTest, BeyondThreeSpacingsNothingIsSaid) {
  Sheets sheets;
  sheets.Add(0, 20, 0);
  sheets.Add(1, 20, 3.1);
  EXPECT_TRUE(BridgeComponents(sheets.cloud, sheets.component, 2, RunContext())->empty());
  std::fill(sheets.component.begin(), sheets.component.end(), 0);
  EXPECT_TRUE(BridgeComponents(sheets.cloud, sheets.component, 1, RunContext())->empty());
}

// A plate whose narrow sides were not seen: no edge of the graph joins its faces, and neither face
// alone has an outside.
TEST(ComponentBridgesTest, ThePlateGetsAnOutside) {
  Sheets plate;
  plate.Add(0, 40, 0);
  plate.Add(1, 40, 2.9);
  const PointIndex index(plate.cloud.points);
  NeighborOptions options;
  options.k = 6;
  const NeighborGraph graph = *BuildNeighborGraph(index, plate.cloud.points, options, RunContext());
  ASSERT_EQ(OrientNormals(graph, {}, {}, &plate.cloud, RunContext())->components, 2);
  for (size_t i = 0; i < plate.component.size(); ++i) {
    EXPECT_EQ(plate.cloud.normals(2, static_cast<int64_t>(i)), plate.component[i] == 0 ? -1 : 1);
  }
}

}  // namespace
}  // namespace rilievo
