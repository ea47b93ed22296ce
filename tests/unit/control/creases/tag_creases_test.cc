#include "core/control/creases/tag_creases.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/geometry/mesh_topology.h"
#include "core/loop/crease_topology.h"
#include "tests/scans/random.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

const Vector3d kHalfBox(0.32, 0.28, 0.24);

// On how many sides of the box a point lies.
int SidesAt(const Vector3d& point, double tolerance) {
  int sides = 0;
  for (int axis = 0; axis < 3; ++axis) {
    sides += std::abs(std::abs(point[axis]) - kHalfBox[axis]) < tolerance;
  }
  return sides;
}

// A box mesh of some 30 points a face, all its vertices moved at random by `shake`.
ControlMesh ShakenBox(double shake) {
  ControlMesh mesh = BoxMesh(kHalfBox, 0.08);
  Random random(5);
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v) {
    mesh.vertices.col(v) += shake * Vector3d(random.Normal(), random.Normal(), random.Normal());
  }
  return mesh;
}

int EdgesOfTheBox(const ControlMesh& mesh) {
  const MeshTopology topology =
      *BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  int count = 0;
  for (const auto& edge : topology.edge_vertices.colwise()) {
    const Vector3d middle = (mesh.vertices.col(edge[0]) + mesh.vertices.col(edge[1])) / 2;
    count += SidesAt(middle, 1e-9) == 2;
  }
  return count;
}

TEST(TagCreasesTest, ABoxGetsItsEdgesAndCorners) {
  const OrientedCloud cloud = BoxCloud(kHalfBox, 20'000);
  const PointIndex index(cloud.points);
  const int wanted = EdgesOfTheBox(BoxMesh(kHalfBox, 0.08));
  ControlMesh mesh = ShakenBox(0.004);
  const ControlMesh given = mesh;
  ASSERT_TRUE(TagCreases(cloud, index, RunContext(), &mesh).ok());
  EXPECT_GE(static_cast<int>(mesh.creases.size()), wanted * 95 / 100);
  EXPECT_LE(static_cast<int>(mesh.creases.size()), wanted);
  double worst = 0, worst_given = 0;
  for (const Crease& crease : mesh.creases) {
    for (int v : {crease.a, crease.b}) {
      const auto off = [&](const ControlMesh& of) {
        Eigen::Array3d away = (of.vertices.col(v).cwiseAbs() - kHalfBox).cwiseAbs().array();
        std::sort(away.begin(), away.end());
        return away[1];  // from the second of the two nearest sides
      };
      worst = std::max(worst, off(mesh));
      worst_given = std::max(worst_given, off(given));
    }
  }
  EXPECT_GT(worst_given, 0.008);
  EXPECT_LT(worst, 0.0005);
  const MeshTopology topology =
      *BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols()));
  const auto creases = BuildCreaseTopology(mesh, topology);
  ASSERT_TRUE(creases.ok()) << creases.status();
  EXPECT_EQ(std::count(creases->kinds.begin(), creases->kinds.end(), VertexKind::kCorner), 8);
}

TEST(TagCreasesTest, SmoothSurfacesKeepTheirMesh) {
  const OrientedCloud cloud = SphereCloud(0.3, 20'000);
  const PointIndex index(cloud.points);
  ControlMesh mesh = OctahedralSphere(0.3, 3);
  const ControlMesh given = mesh;
  ASSERT_TRUE(TagCreases(cloud, index, RunContext(), &mesh).ok());
  EXPECT_TRUE(mesh.creases.empty());
  EXPECT_TRUE(mesh.corners.empty());
  EXPECT_EQ(mesh.vertices, given.vertices);
  EXPECT_EQ(mesh.faces, given.faces);
}

TEST(TagCreasesTest, TheNumberOfThreadsDoesNotChangeABit) {
  const OrientedCloud cloud = BoxCloud(kHalfBox, 20'000);
  const PointIndex index(cloud.points);
  ControlMesh one = ShakenBox(0.004), three = one;
  RunContext context;
  context.threads = 1;
  ASSERT_TRUE(TagCreases(cloud, index, context, &one).ok());
  context.threads = 3;
  ASSERT_TRUE(TagCreases(cloud, index, context, &three).ok());
  EXPECT_EQ(one.vertices, three.vertices);
  EXPECT_EQ(one.faces, three.faces);
  EXPECT_EQ(one.creases, three.creases);
  EXPECT_EQ(one.corners, three.corners);
}

TEST(TagCreasesTest, RefusesWhatIsNoManifold) {
  const OrientedCloud cloud = SphereCloud(0.3, 1'000);
  const PointIndex index(cloud.points);
  ControlMesh mesh = OctahedralSphere(0.3, 1);
  mesh.faces.col(0) = mesh.faces.col(1);
  EXPECT_EQ(TagCreases(cloud, index, RunContext(), &mesh).code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
