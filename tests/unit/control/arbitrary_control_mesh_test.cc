// The main road, core/control/arbitrary_control_mesh.cc.
#include "core/control/arbitrary_control_mesh.h"

#include <gtest/gtest.h>

#include "core/control/simplify/uncovered_points.h"
#include "core/geometry/mesh_topology.h"
#include "tests/unit/control/oriented_shapes.h"
#include "tests/unit/control/pronged_ball.h"

namespace rilievo {
namespace {

ControlMesh MeshOf(const OrientedShape& shape, int target_faces, const RunContext& context) {
  return ArbitraryControlMesh(shape.cloud, shape.graph, shape.index, BoundaryRule::kKeep,
                              CreaseRule::kAuto, target_faces, context)
      .value()
      .mesh;
}

TEST(ArbitraryControlMeshTest, KeepsGenusAndComponents) {
  const struct {
    ShapePtr shape;
    double area;
    int genus, components;
  } cases[] = {{MakeTorus(), kTorusArea, 1, 1},
               {MakeGenus2(), 2 * kTorusArea, 2, 1},
               {MakePair(), kSphereArea, 1, 2},
               {MakeSphere(), kSphereArea, 0, 1}};
  for (const auto& test : cases) {
    const OrientedShape shape = OrientShape(*test.shape, 30000, test.area);
    const ControlMesh mesh = MeshOf(shape, 1000, RunContext{});
    const TopologySummary topology =
        SummarizeTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
    EXPECT_TRUE(topology.manifold()) << test.shape->name();
    EXPECT_TRUE(topology.closed()) << test.shape->name();
    EXPECT_EQ(topology.genus, test.genus) << test.shape->name();
    EXPECT_EQ(topology.components, test.components) << test.shape->name();
    EXPECT_NEAR(topology.faces, 1000, 100) << test.shape->name();
  }
}

TEST(ArbitraryControlMeshTest, TheNumberOfThreadsDoesNotChangeABit) {
  const OrientedShape shape = OrientShape(*MakeTorus(), 10000, kTorusArea);
  const auto run = [&](int threads) {
    RunContext context;
    context.threads = threads;
    return MeshOf(shape, 400, context);
  };
  const ControlMesh one = run(1), three = run(3);
  EXPECT_EQ(one.faces, three.faces);
  EXPECT_EQ(one.vertices, three.vertices);
}

// The first simplification cuts them off: 47 points are out of reach of it.
TEST(ArbitraryControlMeshTest, ProngsStayInReach) {
  const OrientedCloud cloud = CloudOf(MarchTetrahedra(ProngedBallField, 160));
  const PointIndex index(cloud.points);
  const NeighborGraph graph =
      BuildNeighborGraph(index, cloud.points, NeighborOptions{}, RunContext{}).value();
  const ArbitraryMesh made = ArbitraryControlMesh(cloud, graph, index, BoundaryRule::kKeep,
                                                  CreaseRule::kAuto, 60, RunContext{})
                                 .value();
  const UncoveredPoints lost =
      FindUncoveredPoints(made.cloud, made.mesh, {.spacings = 1, .noises = 4, .cosine = 0.3},
                          RunContext{})
          .value();
  EXPECT_LT(lost.points.size(), 20);
}

}  // namespace
}  // namespace rilievo
