#include "core/pipeline/domain_of_mesh.h"

#include <gtest/gtest.h>

#include "core/loop/refinement.h"
#include "core/surface/mass_properties.h"
#include "tests/unit/voxels/closed_meshes.h"

namespace rilievo {
namespace {

// A prism with its lids, each a fan around the middle.
Shape Prism(int sides) {
  std::vector<Eigen::Vector3d> p = {{0, 0, -.2}, {0, 0, .2}};
  std::vector<std::array<int, 3>> t;
  for (int i = 0; i < sides; ++i) {
    const double turn = 2 * std::numbers::pi * i / sides;
    for (const double z : {-.2, .2}) p.emplace_back(.4 * std::cos(turn), .4 * std::sin(turn), z);
    const int low = 2 + 2 * i, next = 2 + 2 * ((i + 1) % sides);
    t.insert(
        t.end(),
        {{low, next, next + 1}, {low, next + 1, low + 1}, {0, next, low}, {1, low + 1, next + 1}});
  }
  const TriangleMesh mesh = MeshOf(p, t);
  return {mesh.vertices, mesh.triangles};
}

// The limit surface has the area and the volume of the mesh.
void ExpectTheMeshItself(const Shape& mesh) {
  const auto control = ControlMeshOfFewTriangles(mesh, mesh.triangles.cols() + 1);
  ASSERT_TRUE(control.has_value());
  const LoopRefinement refinement = RefineTopology(*control, 2, {}).value();
  const LimitSurface limit = EvaluateLimit(refinement, control->vertices, 2, {}).value();
  const MassProperties given = MassPropertiesOf(mesh.vertices, mesh.triangles).value(),
                       made = MassPropertiesOf(limit.positions, FinestFaces(refinement)).value();
  EXPECT_NEAR(made.area, given.area, 1e-12);
  EXPECT_NEAR(made.volume, given.volume, 1e-12);
  EXPECT_NEAR((made.centroid - given.centroid).norm(), 0, 1e-12);
}

TEST(DomainOfMeshTest, ItsLimitIsTheMeshItself) {
  ExpectTheMeshItself(Prism(12));
  // Open: two triangles that are bent at the edge in between, whose other corners are ears.
  const TriangleMesh bent =
      MeshOf({{0, 0, 0}, {.3, 0, 0}, {0, .4, 0}, {.2, .3, .2}}, {{0, 1, 2}, {1, 3, 2}});
  ExpectTheMeshItself({bent.vertices, bent.triangles});
}

TEST(DomainOfMeshTest, OtherMeshesAreNone) {
  EXPECT_FALSE(ControlMeshOfFewTriangles({}, 100));
  EXPECT_FALSE(ControlMeshOfFewTriangles(Prism(12), 48));  // no fewer than that
  EXPECT_TRUE(ControlMeshOfFewTriangles(Prism(64), 3000));
  EXPECT_FALSE(ControlMeshOfFewTriangles(Prism(65), 3000));  // a fan of 65
  Shape flat = Prism(12);
  flat.vertices.col(2) = flat.vertices.col(3);
  EXPECT_FALSE(ControlMeshOfFewTriangles(flat, 3000));  // a triangle without area
}

}  // namespace
}  // namespace rilievo
