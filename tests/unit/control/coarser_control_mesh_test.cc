#include "core/control/coarser_control_mesh.h"

#include <gtest/gtest.h>

#include "core/geometry/mesh_topology.h"
#include "tests/unit/control/oriented_shapes.h"

namespace rilievo {
namespace {

ControlMesh MeshOf(const OrientedShape& shape) {
  ControlOptions options;
  options.topology = Topology::kArbitrary;
  options.target_faces = 800;
  return BuildControlMesh(shape.cloud, shape.graph, shape.index, options, RunContext{})
      .value()
      .mesh;
}

TEST(CoarserControlMeshTest, FewerFacesOfTheSameTopologyOnTheSurface) {
  const ShapePtr torus = MakeTorus();
  const OrientedShape shape = OrientShape(*torus, 20000, kTorusArea);
  const ControlMesh mesh = CoarserControlMesh(shape.cloud, shape.index, MeshOf(shape), 200,
                                              CreaseRule::kAuto, RunContext{})
                               .value();
  EXPECT_NEAR(static_cast<double>(mesh.faces.cols()), 200, 2);
  const TopologySummary summary =
      SummarizeTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  EXPECT_TRUE(summary.manifold());
  EXPECT_EQ(summary.genus, 1);
  EXPECT_EQ(summary.boundary_loops, 0);
  for (const auto vertex : mesh.vertices.colwise()) {
    EXPECT_LT(std::abs(torus->Distance(vertex * shape.scale)) / shape.scale, 0.01);
  }
}

TEST(CoarserControlMeshTest, CreasesAreFoundAnewUnlessTheyAreOff) {
  const OrientedShape shape = OrientShape(*MakeCutBox(), 40000, 8);
  const ControlMesh start = MeshOf(shape);
  ASSERT_GT(start.creases.size(), 20u);
  const auto coarser = [&](CreaseRule rule) {
    return CoarserControlMesh(shape.cloud, shape.index, start, 300, rule, RunContext{}).value();
  };
  EXPECT_GT(coarser(CreaseRule::kAuto).creases.size(), 10u);
  EXPECT_TRUE(coarser(CreaseRule::kOff).creases.empty());
}

TEST(CoarserControlMeshTest, AMeshThatIsNoManifoldIsRefused) {
  const OrientedShape shape = OrientShape(*MakeTorus(), 2000, kTorusArea);
  ControlMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Random(3, 5);
  mesh.faces.resize(3, 3);
  mesh.faces << 0, 0, 0, 1, 1, 1, 2, 3, 4;
  EXPECT_EQ(CoarserControlMesh(shape.cloud, shape.index, mesh, 4, CreaseRule::kOff, RunContext{})
                .status()
                .code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
