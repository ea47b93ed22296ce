#include "core/control/simplify/coarser_control_mesh.h"

#include <gtest/gtest.h>

#include "core/control/build_control_mesh.h"
#include "core/geometry/mesh_topology.h"
#include "tests/unit/control/oriented_shapes.h"

namespace rilievo {
namespace {

ControlMesh MeshOf(const OrientedShape& shape) {
  ControlOptions options;
  options.topology = Topology::kArbitrary;
  options.target_faces = 800;
  return BuildControlMesh(shape.cloud, shape.graph, shape.index, {}, options, {}).value().mesh;
}

TEST(CoarserControlMeshTest, FewerFacesOfTheSameTopologyOnTheSurface) {
  const ShapePtr torus = MakeTorus();
  const OrientedShape shape = OrientShape(*torus, 20000, kTorusArea);
  const ControlMesh mesh = CoarserControlMesh(MeshOf(shape), 200, RunContext{}).value();
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

TEST(CoarserControlMeshTest, CreasesAreCarriedAlong) {
  const OrientedShape shape = OrientShape(*MakeCutBox(), 40000, 8);
  const ControlMesh start = MeshOf(shape);
  ASSERT_GT(start.creases.size(), 20u);
  const ControlMesh coarser = CoarserControlMesh(start, 300, RunContext{}).value();
  EXPECT_LT(coarser.creases.size(), start.creases.size());
  EXPECT_EQ(coarser.corners.size(), start.corners.size());
  const auto length = [](const ControlMesh& mesh) {
    double sum = 0;
    for (const Crease& crease : mesh.creases) {
      sum += (mesh.vertices.col(crease.a) - mesh.vertices.col(crease.b)).norm();
    }
    return sum;
  };
  EXPECT_NEAR(length(coarser), length(start), 0.05 * length(start));
}

TEST(CoarserControlMeshTest, AMeshThatIsNoManifoldIsRefused) {
  ControlMesh mesh;
  mesh.vertices = Eigen::Matrix3Xd::Random(3, 5);
  mesh.faces.resize(3, 3);
  mesh.faces << 0, 0, 0, 1, 1, 1, 2, 3, 4;
  EXPECT_EQ(CoarserControlMesh(mesh, 4, RunContext{}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
