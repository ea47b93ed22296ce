#include "core/control/topology/remove_handles.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/control/implicit/marching_cubes.h"
#include "core/control/topology/nonseparating_loop.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_normals.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

// A wall in [-0.5, 0.5]^3 with a round hole of the given radius through its middle.
ControlMesh WallWithHole(double radius, double half_thickness = 0.06) {
  ImplicitFunction function;
  function.origin = Eigen::Vector3d::Constant(-0.5);
  function.levels.resize(1);
  GridLevel& level = function.levels[0];
  level.cell = 1.0 / 48;
  level.grid.AddBox({0, 0, 0}, {48, 48, 48});
  level.grid.Seal();
  for (const Eigen::Vector3i& node : level.grid.Nodes()) {
    const Eigen::Vector3d x = function.origin + level.cell * node.cast<double>();
    const double slab = std::max(
        {std::abs(x.z()) - half_thickness, std::abs(x.x()) - 0.41, std::abs(x.y()) - 0.41});
    const double hole = radius - std::hypot(x.x() - 0.07, x.y());
    level.values.push_back(static_cast<float>(std::max(slab, hole) + 1e-4));
  }
  return ExtractIsoSurface(function, RunContext{}).value();
}

using Searches = std::vector<HandleLengths>;

TEST(SmallHandlesTest, ANarrowHoleIsClosedAndTheMeshStaysAManifold) {
  const ControlMesh wall = WallWithHole(0.05);
  ASSERT_EQ(Summary(wall).genus, 1);
  const auto result = RemoveHandles(wall, Searches{{.longest = 0.6}}, nullptr, RunContext{});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->removed, 1);
  const TopologySummary topology = Summary(result->mesh);
  EXPECT_EQ(topology.genus, 0);
  EXPECT_EQ(topology.components, 1);
  EXPECT_TRUE(topology.closed());
  EXPECT_TRUE(
      BuildMeshTopology(result->mesh.faces, static_cast<int>(result->mesh.vertices.cols())).ok());
}

TEST(SmallHandlesTest, AWideHoleStays) {
  const ControlMesh wall = WallWithHole(0.2);
  ASSERT_EQ(Summary(wall).genus, 1);
  const auto result = RemoveHandles(wall, Searches{{.longest = 0.35}}, nullptr, RunContext{});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->removed, 0);
  EXPECT_EQ(result->mesh.faces, wall.faces);
}

// Vertices of a mesh as points with the normals there; without the wall of a hole, the points of
// the flat sides only.
OrientedCloud PointsOn(const ControlMesh& mesh, bool hole_wall) {
  const Eigen::Matrix3Xd normals = VertexNormals(mesh.vertices, mesh.faces);
  std::vector<int> kept;
  for (int v = 0; v < mesh.vertices.cols(); ++v) {
    if (hole_wall || std::abs(normals(2, v)) > 0.95) kept.push_back(v);
  }
  OrientedCloud cloud;
  cloud.points = mesh.vertices(Eigen::all, kept);
  cloud.normals = normals(Eigen::all, kept);
  cloud.spacing.assign(kept.size(), 1.0f / 48);
  cloud.noise.assign(kept.size(), 0.0f);
  return cloud;
}

int RemovedWith(const ControlMesh& wall, const OrientedCloud& cloud, const HandleLengths& lengths) {
  const PointIndex index(cloud.points);
  const LoopSupport support(cloud, index);
  const auto result = RemoveHandles(wall, Searches{lengths}, &support, RunContext{});
  EXPECT_TRUE(result.ok());
  EXPECT_EQ(Summary(result->mesh).genus, 1 - result->removed);
  return result->removed;
}

// Points all over the hole, as of two sheets that it was torn through.
void AddPointsWithin(double radius, OrientedCloud* cloud) {
  constexpr int kAcross = 9;
  const int64_t count = cloud->points.cols();
  cloud->points.conservativeResize(3, count + kAcross * kAcross);
  cloud->normals.conservativeResize(3, count + kAcross * kAcross);
  for (int i = 0; i < kAcross * kAcross; ++i) {
    const double x = i % kAcross * 2.0 / (kAcross - 1) - 1,
                 y = i / kAcross * 2.0 / (kAcross - 1) - 1;
    const double side = i % 2 == 0 ? 1 : -1;
    cloud->points.col(count + i) << 0.07 + radius * x, radius * y, 0.004 * side;
    cloud->normals.col(count + i) << 0, 0, side;
  }
  cloud->spacing.resize(static_cast<size_t>(cloud->points.cols()), 1.0f / 48);
}

TEST(SmallHandlesTest, AHoleIsClosedWherePointsSpanItAndNoneLineIt) {
  const ControlMesh wall = WallWithHole(0.05, 0.02);
  OrientedCloud cloud = PointsOn(wall, false);
  EXPECT_EQ(RemovedWith(wall, cloud, {.longest = 0.6}), 0);  // an empty hole is a hole
  AddPointsWithin(0.05, &cloud);
  EXPECT_EQ(RemovedWith(wall, cloud, {.longest = 0.6}), 1);
}

// Around so small a hole the points are too far apart to say that it is empty.
TEST(SmallHandlesTest, OfATinyHoleOnlyPointsAroundItSpeak) {
  const ControlMesh wall = WallWithHole(0.05);
  EXPECT_EQ(RemovedWith(wall, PointsOn(wall, true), {.longest = 0.6, .tiny = 0.5}), 0);
  EXPECT_EQ(RemovedWith(wall, PointsOn(wall, false), {.longest = 0.6, .tiny = 0.5}), 1);
  OrientedCloud sparse = PointsOn(wall, true);
  sparse.spacing.assign(sparse.spacing.size(), 0.1f);  // three around the hole
  EXPECT_EQ(RemovedWith(wall, sparse, {.longest = 0.6, .tiny = 0.5}), 1);
}

TEST(SmallHandlesTest, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  RunContext context;
  context.stop = stop.get_token();
  EXPECT_EQ(RemoveHandles(WallWithHole(0.1), Searches{{.longest = 0.5}}, nullptr, context)
                .status()
                .code(),
            absl::StatusCode::kCancelled);
}

TEST(LocalLoopTest, TheLoopFoundGoesAroundTheHole) {
  const ControlMesh wall = WallWithHole(0.05);
  const MeshTopology topology =
      BuildMeshTopology(wall.faces, static_cast<int>(wall.vertices.cols())).value();
  NonseparatingLoopFinder finder(topology, wall.vertices);
  int near_hole = 0;
  for (int v = 0; v < topology.vertex_count; ++v) {
    const auto distance = [&](int i) {
      return (wall.vertices.col(i) - Eigen::Vector3d(0.12, 0, 0)).norm();
    };
    if (distance(v) < distance(near_hole)) near_hole = v;
  }
  const std::vector<int> loop = finder.LoopAround(near_hole, 0.4);
  ASSERT_GE(loop.size(), 3u);
  EXPECT_GT(finder.Length(loop), 0.95 * 2 * M_PI * 0.05);  // a polygon in the circle
  EXPECT_LT(finder.Length(loop), 0.7);
  double turns = 0;  // around the axis of the hole
  for (size_t i = 0; i < loop.size(); ++i) {
    const auto angle = [&](int v) {
      return std::atan2(wall.vertices(1, v), wall.vertices(0, v) - 0.07);
    };
    turns += std::remainder(angle(loop[(i + 1) % loop.size()]) - angle(loop[i]), 2 * M_PI);
  }
  EXPECT_NEAR(std::abs(turns), 2 * M_PI, 1e-9);
}

TEST(LocalLoopTest, ADiscWithoutAHandleHasNoLoop) {
  const ControlMesh wall = WallWithHole(0.05);
  const MeshTopology topology =
      BuildMeshTopology(wall.faces, static_cast<int>(wall.vertices.cols())).value();
  NonseparatingLoopFinder finder(topology, wall.vertices);
  int corner = 0;
  for (int v = 0; v < topology.vertex_count; ++v) {
    if (wall.vertices.col(v).sum() < wall.vertices.col(corner).sum()) corner = v;
  }
  EXPECT_TRUE(finder.LoopAround(corner, 0.3).empty());
}

}  // namespace
}  // namespace rilievo
