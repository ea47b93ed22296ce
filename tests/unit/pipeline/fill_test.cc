// What comes of a closed surface where the scan has no points.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "core/pipeline/reconstruct.h"
#include "core/surface/displaced_surface.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

using Inside = std::function<bool(const Eigen::Vector3d&)>;

PointCloud SphereWithout(int count, const Inside& is_missing) {
  testing::Random random(5);
  PointCloud scan;
  scan.points.resize(3, count);
  for (int i = 0; i < count;) {
    const double z = random.Signed(), angle = std::numbers::pi * random.Signed();
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3d point(r * std::cos(angle), r * std::sin(angle), z);
    if (!is_missing(point)) scan.points.col(i++) = point;
  }
  return scan;
}

// RMS distance from the unit sphere where points are missing, of the diagonal.
double FillError(const Reconstruction& made, const Inside& is_missing) {
  const TriangleMesh mesh = Tessellate(made.surface, made.surface.max_level, RunContext{}).value();
  double squares = 0, count = 0;
  for (const auto vertex : mesh.vertices.colwise()) {
    if (!is_missing(vertex)) continue;
    squares += std::pow((vertex.norm() - 1) / made.report.diagonal, 2);
    count += 1;
  }
  return std::sqrt(squares / count);
}

TEST(FillTest, ACapOfASphereComesBack) {
  const std::pair<double, double> cases[] = {{0.9, 3e-4}, {0.7, 5e-4}, {0.4, 8e-4}};
  for (const auto& [height, most] : cases) {
    const Inside is_missing = [height = height](const Eigen::Vector3d& p) { return p[2] > height; };
    ReconstructOptions options;
    options.control.boundary = BoundaryRule::kClose;
    const auto made = Reconstruct(SphereWithout(12000, is_missing), options, RunContext{});
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_EQ(made->report.boundary_loops, 0);
    EXPECT_LT(FillError(*made, is_missing), most) << height;
  }
}

}  // namespace
}  // namespace rilievo
