#include "core/control/creases/feature_planes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <stop_token>

#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kHalfCube = 0.3;

// The right and the upper side of a box, and the bevel that an iso-surface makes of their edge.
ControlMesh Bevel(double width) {
  ControlMesh mesh;
  mesh.vertices.resize(3, 8);
  const double h = kHalfCube, w = width;
  mesh.vertices << h, h, h, h, h - w, h - w, -h, -h,  //
      -0.1, 0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.1,     //
      -h, -h, h - w, h - w, h, h, h, h;
  mesh.faces.resize(3, 6);
  mesh.faces << 0, 1, 2, 3, 4, 5,  //
      1, 3, 3, 5, 5, 7,            //
      2, 2, 4, 4, 6, 6;
  return mesh;
}

TEST(FeaturePlanesTest, ABevelTakesTheSidesOfItsEdge) {
  const OrientedCloud cloud = BoxCloud(Vector3d::Constant(kHalfCube), 20'000);
  const PointIndex index(cloud.points);
  const ControlMesh mesh = Bevel(2 * cloud.median_spacing);
  const auto planes = FeaturePlanes(cloud, index, mesh, RunContext());
  ASSERT_TRUE(planes.ok());
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    const Vector3d normal = planes->normals.col(f), point = planes->points.col(f);
    EXPECT_NEAR(std::max(normal.x(), normal.z()), 1, 1e-9) << f;
    EXPECT_NEAR(normal.dot(point), kHalfCube, 1e-9) << f;
  }
  // Each face of the bevel its nearer side.
  EXPECT_NEAR(planes->normals(0, 2), 1, 1e-9);
  EXPECT_NEAR(planes->normals(2, 3), 1, 1e-9);
}

TEST(FeaturePlanesTest, FlatFacesKeepTheirOwn) {
  const OrientedCloud cloud = BoxCloud(Vector3d::Constant(kHalfCube), 20'000);
  const PointIndex index(cloud.points);
  // Beside the scan, flat: nothing bends, nothing is asked of the points.
  ControlMesh mesh;
  mesh.vertices.resize(3, 4);
  mesh.vertices << -0.1, 0.1, -0.1, 0.1, -0.1, -0.1, 0.1, 0.1, 0.35, 0.35, 0.35, 0.35;
  mesh.faces.resize(3, 2);
  mesh.faces << 0, 1, 1, 3, 2, 2;
  const auto planes = FeaturePlanes(cloud, index, mesh, RunContext());
  ASSERT_TRUE(planes.ok());
  for (int f = 0; f < 2; ++f) {
    EXPECT_NEAR(planes->normals(2, f), 1, 1e-12);
    EXPECT_NEAR(planes->points(2, f), 0.35, 1e-12);
  }
}

TEST(FeaturePlanesTest, StopsWhenAsked) {
  const OrientedCloud cloud = BoxCloud(Vector3d::Constant(kHalfCube), 2'000);
  const PointIndex index(cloud.points);
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(FeaturePlanes(cloud, index, Bevel(0.02), context).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
