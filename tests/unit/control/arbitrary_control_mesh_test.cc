// The main road, core/control/arbitrary_control_mesh.cc.
#include "core/control/arbitrary_control_mesh.h"

#include <gtest/gtest.h>

#include "core/control/simplify/uncovered_points.h"
#include "core/geometry/mesh_topology.h"
#include "tests/unit/control/oriented_shapes.h"
#include "tests/unit/control/pronged_ball.h"

namespace rilievo {
namespace {

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
    OrientedShape shape = OrientShape(*test.shape, 30000, test.area);
    const ControlMesh mesh = ArbitraryControlMesh(shape.graph, shape.index, BoundaryRule::kKeep,
                                                  1000, RunContext{}, &shape.cloud)
                                 .value();
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
    OrientedCloud cloud = shape.cloud;
    return ArbitraryControlMesh(shape.graph, shape.index, BoundaryRule::kKeep, 400, context, &cloud)
        .value();
  };
  const ControlMesh one = run(1), three = run(3);
  EXPECT_EQ(one.faces, three.faces);
  EXPECT_EQ(one.vertices, three.vertices);
}

// The first simplification cuts them off: 47 points are out of reach of it.
TEST(ArbitraryControlMeshTest, ProngsStayInReach) {
  OrientedCloud cloud = CloudOf(MarchTetrahedra(ProngedBallField, 160));
  const PointIndex index(cloud.points);
  const NeighborGraph graph =
      BuildNeighborGraph(index, cloud.points, NeighborOptions{}, RunContext{}).value();
  const ControlMesh mesh =
      ArbitraryControlMesh(graph, index, BoundaryRule::kKeep, 60, RunContext{}, &cloud).value();
  const UncoveredPoints lost =
      FindUncoveredPoints(cloud, mesh, ControlStage::kTaken,
                          {.spacings = 1, .noises = 4, .cosine = 0.3}, RunContext{})
          .value();
  EXPECT_LT(lost.points.size(), 20);
}

}  // namespace
}  // namespace rilievo
