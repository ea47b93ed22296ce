#include "core/control/implicit/implicit_function.h"

#include <gtest/gtest.h>

#include "core/control/implicit/marching_cubes.h"
#include "core/geometry/mesh_topology.h"
#include "tests/unit/control/oriented_shapes.h"

namespace rilievo {
namespace {

ControlMesh ZeroSet(const OrientedShape& shape, const ImplicitOptions& options) {
  const ImplicitFunction function =
      FitImplicitFunction(shape.cloud, shape.graph, shape.index, options, RunContext{}).value();
  return ExtractIsoSurface(function, RunContext{}).value();
}

TEST(ImplicitFunctionTest, TheZeroSetFollowsATorus) {
  const ShapePtr torus = MakeTorus();
  const OrientedShape shape = OrientShape(*torus, 20000, kTorusArea);
  const ControlMesh mesh = ZeroSet(shape, ImplicitOptions{});
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_TRUE(topology.closed());
  EXPECT_EQ(topology.components, 1);
  EXPECT_EQ(topology.genus, 1);
  const ShapeError error = MeasureAgainstShape(*torus, mesh.vertices * shape.scale);
  EXPECT_LT(error.rms / shape.scale, 0.1 * shape.cloud.median_spacing);
  EXPECT_LT(error.max / shape.scale, 0.5 * shape.cloud.median_spacing);
}

TEST(ImplicitFunctionTest, NoiseIsAveragedAndNotFollowed) {
  const ShapePtr torus = MakeTorus();
  const OrientedShape shape = OrientShape(*torus, 50000, kTorusArea, 0.003);
  const ControlMesh mesh = ZeroSet(shape, ImplicitOptions{});
  EXPECT_EQ(SummarizeTopology(mesh.faces, mesh.vertices.cols()).genus, 1);
  const ShapeError error = MeasureAgainstShape(*torus, mesh.vertices * shape.scale);
  EXPECT_LT(error.rms / shape.scale, 0.5 * 0.003);
}

// Two concentric spheres, the wall between them 1.1 spacings thick.
TEST(ImplicitFunctionTest, AWallAsThinAsTheSpacingStaysWhole) {
  const OrientedShape outer = OrientShape(*MakeSphere(), 20000, kSphereArea);
  const double thickness = 1.1 * outer.cloud.median_spacing;
  const double radius = outer.cloud.points.col(0).norm();
  OrientedShape wall = OrientShape(*MakeSphere(), 20000, kSphereArea, 0, 2);
  const double shrink = (radius - thickness) / radius;
  Eigen::Matrix3Xd points(3, 40000), normals(3, 40000);
  points << outer.cloud.points, wall.cloud.points * shrink;
  normals << outer.cloud.normals, -wall.cloud.normals;
  wall.cloud.points = points;
  wall.cloud.normals = normals;
  wall.cloud.spacing.resize(40000, wall.cloud.spacing[0]);
  wall.cloud.noise.resize(40000, 0.0f);
  wall.index = PointIndex(points);
  wall.graph = BuildNeighborGraph(wall.index, points, NeighborOptions{}, RunContext{}).value();
  const ControlMesh mesh = ZeroSet(wall, ImplicitOptions{});
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_EQ(topology.components, 2);
  EXPECT_EQ(topology.genus, 0);
  EXPECT_TRUE(topology.closed());
}

TEST(ImplicitFunctionTest, AFewNormalsTheWrongWayRoundAreOutvoted) {
  OrientedShape shape = OrientShape(*MakeTorus(), 20000, kTorusArea);
  const ControlMesh right = ZeroSet(shape, ImplicitOptions{});
  for (int i = 0; i < 20000; i += 20) shape.cloud.normals.col(i) *= -1;
  const ControlMesh mesh = ZeroSet(shape, ImplicitOptions{});
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_TRUE(topology.closed());
  EXPECT_EQ(topology.components, 1);
  EXPECT_EQ(topology.genus, 1);
  EXPECT_NEAR(mesh.faces.cols(), right.faces.cols(), 0.01 * right.faces.cols());
}

TEST(ImplicitFunctionTest, TheGridStaysInProportionToThePoints) {
  const OrientedShape shape = OrientShape(*MakeTorus(), 20000, kTorusArea);
  const ImplicitFunction function =
      FitImplicitFunction(shape.cloud, shape.graph, shape.index, ImplicitOptions{}, RunContext{})
          .value();
  int nodes = 0;
  for (const GridLevel& level : function.levels) nodes += level.grid.size();
  EXPECT_LT(nodes, 10 * 20000);
}

// Of points along a line most of the cells around would hold none.
TEST(ImplicitFunctionTest, PointsAlongACurveGetCoarserCells) {
  constexpr int kPoints = 20000;
  constexpr double kRadius = 0.35;
  OrientedCloud cloud;
  cloud.points.resize(3, kPoints);
  for (int i = 0; i < kPoints; ++i) {
    const double angle = 2 * std::numbers::pi * i / kPoints;
    cloud.points.col(i) << kRadius * std::cos(angle), kRadius * std::sin(angle), 0;
  }
  cloud.normals = cloud.points / kRadius;
  cloud.median_spacing = 3 * 2 * std::numbers::pi * kRadius / kPoints;  // as 16 neighbours tell it
  cloud.spacing.assign(kPoints, static_cast<float>(cloud.median_spacing));
  cloud.noise.assign(kPoints, 0.0f);
  const PointIndex index(cloud.points);
  const NeighborGraph graph =
      BuildNeighborGraph(index, cloud.points, NeighborOptions{}, RunContext{}).value();
  const ImplicitFunction function =
      FitImplicitFunction(cloud, graph, index, ImplicitOptions{}, RunContext{}).value();
  int64_t finer = 0;
  for (size_t level = 1; level < function.levels.size(); ++level) {
    finer += function.levels[level].grid.size();
  }
  EXPECT_LT(finer, 1.1 * MostImplicitNodes(kPoints));
  EXPECT_GT(finer, 0.1 * MostImplicitNodes(kPoints));
}

// A sphere thirty times as dense on one half: small cells there, large ones on the other.
TEST(ImplicitFunctionTest, CellsFollowTheSpacing) {
  OrientedShape shape = OrientShape(*MakeSphere(), 60000, kSphereArea);
  OrientedCloud& cloud = shape.cloud;
  std::vector<int> kept;
  for (int i = 0; i < 60000; ++i) {
    if (cloud.points(2, i) > 0 || i % 30 == 0) kept.push_back(i);
  }
  for (size_t k = 0; k < kept.size(); ++k) {
    const bool dense = cloud.points(2, kept[k]) > 0;
    cloud.spacing[k] = static_cast<float>(cloud.median_spacing * (dense ? 1 : std::sqrt(30.0)));
  }
  cloud.spacing.resize(kept.size());
  cloud.points = cloud.points(Eigen::all, kept).eval();
  cloud.normals = cloud.normals(Eigen::all, kept).eval();
  shape.index = PointIndex(cloud.points);
  shape.graph =
      BuildNeighborGraph(shape.index, cloud.points, NeighborOptions{}, RunContext{}).value();
  const ControlMesh mesh = ZeroSet(shape, ImplicitOptions{});
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_TRUE(topology.closed());
  EXPECT_EQ(topology.euler, 2);
  // Away from the equator, where the dense half ends like a border.
  const auto z = mesh.vertices.row(2).array() / mesh.vertices.row(2).maxCoeff();
  EXPECT_GT((z > 0.2).count(), 4 * (z < -0.2).count());
  const ShapeError error = MeasureAgainstShape(*MakeSphere(), mesh.vertices * shape.scale);
  EXPECT_LT(error.rms / shape.scale, 0.2 * cloud.median_spacing);
}

}  // namespace
}  // namespace rilievo
