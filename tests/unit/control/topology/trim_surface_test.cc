#include "core/control/topology/trim_surface.h"

#include <gtest/gtest.h>

#include "core/control/implicit/implicit_function.h"
#include "core/control/implicit/marching_cubes.h"
#include "core/control/simplify/mesh_subset.h"
#include "core/geometry/mesh_topology.h"
#include "tests/unit/control/oriented_shapes.h"

namespace rilievo {
namespace {

// A cloud of the points of `shape` that `keep` accepts, spacing as of the whole.
template <typename Keep>
OrientedShape Cut(const OrientedShape& shape, const Keep& keep) {
  std::vector<int> kept;
  for (int i = 0; i < shape.cloud.points.cols(); ++i) {
    if (keep(Eigen::Vector3d(shape.cloud.points.col(i)))) kept.push_back(i);
  }
  OrientedCloud cloud;
  cloud.points = shape.cloud.points(Eigen::all, kept);
  cloud.normals = shape.cloud.normals(Eigen::all, kept);
  cloud.spacing.assign(kept.size(), shape.cloud.spacing[0]);
  cloud.noise.assign(kept.size(), 0.0f);
  cloud.median_spacing = shape.cloud.median_spacing;
  PointIndex index(cloud.points);
  NeighborGraph graph =
      BuildNeighborGraph(index, cloud.points, NeighborOptions{}, RunContext{}).value();
  return {std::move(cloud), std::move(index), std::move(graph), shape.scale};
}

ControlMesh SurfaceOf(const OrientedShape& shape, BoundaryRule boundary) {
  ImplicitOptions options;
  options.closed = boundary == BoundaryRule::kClose;
  const ImplicitFunction function =
      FitImplicitFunction(shape.cloud, shape.graph, shape.index, options, RunContext{}).value();
  const ControlMesh iso = SplitFans(ExtractIsoSurface(function, RunContext{}).value()).mesh;
  return TrimSurface(iso, shape.cloud, shape.index, boundary, RunContext{}).value();
}

TEST(TrimSurfaceTest, AHemisphereKeepsItsRim) {
  const OrientedShape whole = OrientShape(*MakeSphere(), 30000, kSphereArea);
  const OrientedShape half = Cut(whole, [](const Eigen::Vector3d& x) { return x.z() > 0; });
  const ControlMesh mesh = SurfaceOf(half, BoundaryRule::kKeep);
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_TRUE(topology.manifold());
  EXPECT_EQ(topology.components, 1);
  EXPECT_EQ(topology.boundary_loops, 1);
  EXPECT_EQ(topology.euler, 1);
  EXPECT_NEAR(mesh.vertices.row(2).minCoeff(), 0, 2 * half.cloud.median_spacing);
}

TEST(TrimSurfaceTest, AHemisphereIsClosedOnRequest) {
  const OrientedShape whole = OrientShape(*MakeSphere(), 30000, kSphereArea);
  const OrientedShape half = Cut(whole, [](const Eigen::Vector3d& x) { return x.z() > 0; });
  const ControlMesh mesh = SurfaceOf(half, BoundaryRule::kClose);
  const TopologySummary topology = SummarizeTopology(mesh.faces, mesh.vertices.cols());
  EXPECT_TRUE(topology.closed());
  EXPECT_EQ(topology.euler, 2);
}

TEST(TrimSurfaceTest, SmallHolesAreFilledAndLargeOnesKept) {
  const OrientedShape whole = OrientShape(*MakeSphere(), 30000, kSphereArea);
  const double radius = whole.cloud.points.col(0).norm();
  const double spacing = whole.cloud.median_spacing;
  const auto without_cap = [&](double cap) {
    const ControlMesh mesh =
        SurfaceOf(Cut(whole,
                      [&](const Eigen::Vector3d& x) {
                        return (x - Eigen::Vector3d(0, 0, radius)).norm() > cap;
                      }),
                  BoundaryRule::kKeep);
    return SummarizeTopology(mesh.faces, mesh.vertices.cols()).boundary_loops;
  };
  EXPECT_EQ(without_cap(3 * spacing), 0);
  EXPECT_EQ(without_cap(20 * spacing), 1);
}

TEST(TrimSurfaceTest, PiecesWithoutPointsGo) {
  const OrientedShape sphere = OrientShape(*MakeSphere(), 5000, kSphereArea);
  const ControlMesh near = SurfaceOf(sphere, BoundaryRule::kKeep);
  ControlMesh both;
  both.vertices.resize(3, 2 * near.vertices.cols());
  both.vertices << near.vertices, near.vertices.colwise() + Eigen::Vector3d(5, 0, 0);
  both.faces.resize(3, 2 * near.faces.cols());
  both.faces << near.faces, near.faces.array() + static_cast<int>(near.vertices.cols());
  for (const BoundaryRule rule : {BoundaryRule::kKeep, BoundaryRule::kClose}) {
    const ControlMesh kept =
        TrimSurface(both, sphere.cloud, sphere.index, rule, RunContext{}).value();
    EXPECT_EQ(kept.faces.cols(), near.faces.cols());
  }
}

// As wrong normals leave between two sheets: points support it.
TEST(TrimSurfaceTest, ABubbleAFewSpacingsWideGoes) {
  OrientedShape sphere = OrientShape(*MakeSphere(), 5000, kSphereArea);
  const ControlMesh near = SurfaceOf(sphere, BoundaryRule::kKeep);
  const double radius = near.vertices.col(0).norm();
  const auto with_ball_of = [&](double spacings) {
    const double ratio = spacings * sphere.cloud.median_spacing / radius;
    const Eigen::Vector3d inside_wall(0, 0, radius * (1 - ratio));
    ControlMesh both;
    both.vertices.resize(3, 2 * near.vertices.cols());
    both.vertices << near.vertices, (ratio * near.vertices).colwise() + inside_wall;
    both.faces.resize(3, 2 * near.faces.cols());
    both.faces << near.faces, near.faces.array() + static_cast<int>(near.vertices.cols());
    const ControlMesh kept =
        TrimSurface(both, sphere.cloud, sphere.index, BoundaryRule::kClose, RunContext{}).value();
    return kept.faces.cols();
  };
  EXPECT_EQ(with_ball_of(1.5), near.faces.cols());
  EXPECT_EQ(with_ball_of(8), 2 * near.faces.cols());
  // Of points that were chosen from four times as many, which all lie on it.
  sphere.cloud.share_of_spacing = 0.5;
  EXPECT_EQ(with_ball_of(1.5), 2 * near.faces.cols());
}

}  // namespace
}  // namespace rilievo
