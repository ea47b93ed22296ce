#include "core/control/implicit/trilinear_stencil.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/base/run_context.h"
#include "core/control/implicit/sparse_grid.h"

namespace rilievo {
namespace {

TEST(GridFootprintTest, TrilinearWeightsReproduceLinearFunctions) {
  const Eigen::Vector3d at(-1.25, 3.5, 0.75), slope(0.3, -2, 1.5);
  const Trilinear weights(at);
  double sum = 0, value = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i offset(corner & 1, (corner >> 1) & 1, corner >> 2);
    sum += weights.weight[corner];
    value += weights.weight[corner] * slope.dot((weights.base + offset).cast<double>());
  }
  EXPECT_NEAR(sum, 1, 1e-6);
  EXPECT_NEAR(value, slope.dot(at), 1e-5);
}

TEST(GridFootprintTest, CellsAmongTheNodesAroundAreThoseOfTheGrid) {
  SparseGrid grid;
  grid.AddBox({-5, -5, -5}, {5, 5, 5});
  grid.Seal();
  const Eigen::Vector3d at(0.7, -1.2, 2.4);
  SparseGridReader reader(grid);
  NodesAround around;
  around.MoveTo(at, &reader);
  for (int axis = 0; axis < 4; ++axis) {  // where it is, and half a cell down each axis
    Eigen::Vector3d moved = at;
    if (axis < 3) moved[axis] -= 0.5;
    const Eigen::Vector3i base = Trilinear(moved).base;
    std::array<int, 8> corners;
    ASSERT_TRUE(grid.FindCell(base, &corners));
    EXPECT_EQ(around.Cell(base), corners) << axis;
  }
}

// Nodes that stand in for others tell whether they are looked up again.
TEST(GridFootprintTest, NodesAreLookedUpWhereTheyAreOthers) {
  SparseGrid grid;
  grid.AddBox({-5, -5, -5}, {5, 5, 5});
  grid.Seal();
  SparseGridReader reader(grid);
  NodesAround around;
  around.MoveTo({0.7, -1.2, 2.4}, &reader);
  EXPECT_EQ(around.low, Eigen::Vector3i(0, -2, 1));
  EXPECT_EQ(around.nodes[1 + 3 * 2 + 9 * 1], grid.Find({1, 0, 2}));
  const std::array<int, 27> looked_up = around.nodes;
  around.nodes.fill(-7);
  around.MoveTo({0.9, -1.4, 1.6}, &reader);
  EXPECT_EQ(around.nodes[0], -7);
  around.MoveTo({1.6, -1.4, 1.6}, &reader);
  EXPECT_EQ(around.nodes[0], looked_up[1]);
  around.MoveTo({0.9, -1.4, 1.6}, &reader);
  EXPECT_EQ(around.nodes, looked_up);
}

TEST(GridFootprintTest, FloorsAreThoseOfTheLibrary) {
  for (const double value : {-2.0, -1.5, -1e-9, -0.0, 0.0, 0.5, 1.0, 1 - 1e-16, 2.999}) {
    EXPECT_EQ(FloorToInt(value), static_cast<int>(std::floor(value))) << value;
  }
}

TEST(GridFootprintTest, DiscsLieInTheTangentPlaneAndHoldAboutOneOffsetACell) {
  const Eigen::Vector3d normal = Eigen::Vector3d(1, -2, 0.5).normalized();
  std::vector<Eigen::Vector3d> disc;
  TangentDisc(normal, 0.5, &disc);
  EXPECT_EQ(disc.size(), 1);
  for (const double radius : {1.0, 2.5, 4.0}) {
    TangentDisc(normal, radius, &disc);
    for (const Eigen::Vector3d& offset : disc) {
      EXPECT_NEAR(offset.dot(normal), 0, 1e-12);
      EXPECT_LE(offset.norm(), radius);
    }
    const double cells = M_PI * radius * radius;
    EXPECT_GT(static_cast<double>(disc.size()), 0.5 * cells);
    EXPECT_LT(static_cast<double>(disc.size()), 2.5 * cells);
  }
}

}  // namespace
}  // namespace rilievo
