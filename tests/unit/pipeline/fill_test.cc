// What comes of a closed surface where the scan has no points.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "core/codec/container/dss.h"
#include "core/pipeline/certificate.h"
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
  const std::pair<double, double> cases[] = {{0.9, 2e-4}, {0.7, 3.5e-4}, {0.4, 6e-4}};
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

// The back of a cap is flatter than a sphere's, but comes nowhere through the cap.
TEST(FillTest, ABackLargerThanTheScanStaysBehindIt) {
  const Inside is_missing = [](const Eigen::Vector3d& p) { return p[2] < 0.4; };
  ReconstructOptions options;
  options.control.boundary = BoundaryRule::kClose;
  options.control.topology = Topology::kArbitrary;
  const auto made = Reconstruct(SphereWithout(9000, is_missing), options, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->report.boundary_loops, 0);
  EXPECT_LT(made->report.error.b_to_a.rms, 1e-3);
  const TriangleMesh mesh =
      Tessellate(made->surface, made->surface.max_level, RunContext{}).value();
  EXPECT_LT(mesh.vertices.row(2).maxCoeff(), 1.01);
}

// Of caps of a sphere, the one with the shorter rim.
TEST(FillTest, HolesWithAShortRimAloneAreClosed) {
  const Inside small = [](const Eigen::Vector3d& p) { return p[2] > 0.9; };
  const Inside large = [](const Eigen::Vector3d& p) { return p[2] < -0.6; };
  const PointCloud scan =
      SphereWithout(12000, [&](const Eigen::Vector3d& p) { return small(p) || large(p); });
  ReconstructOptions options;  // rims of 2.74 and 5.03
  for (const auto& [length, loops] : {std::pair(2.4, 2), {3.5, 1}, {6.0, 0}}) {
    options.lengths.close_holes_below = length;
    const auto made = Reconstruct(scan, options, RunContext{});
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_EQ(made->report.boundary_loops, loops) << length;
    EXPECT_EQ(made->report.components, 1);
    if (loops < 2) {
      EXPECT_LT(FillError(*made, small), 3e-4) << length;
    }
    if (loops < 1) {
      EXPECT_LT(FillError(*made, large), 8e-4) << length;
    }
  }
}

// Two parts of a sphere that no point joins.
TEST(FillTest, PiecesWithANarrowGapAreJoined) {
  const Inside belt = [](const Eigen::Vector3d& p) { return std::abs(p[2] - 0.3) < 0.1; };
  const PointCloud scan = SphereWithout(12000, belt);
  ReconstructOptions options;
  options.control.topology = Topology::kArbitrary;
  EXPECT_EQ(Reconstruct(scan, options, RunContext{})->report.components, 2);
  options.lengths.bridge_gaps_below = 0.35;
  const auto made = Reconstruct(scan, options, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->report.components, 1);
  EXPECT_EQ(made->report.boundary_loops, 0);
  EXPECT_EQ(made->report.genus, 0);
  EXPECT_LT(FillError(*made, belt), 3e-4);
}

// The part without points is not an error: it was asked for.
TEST(FillTest, AnErrorAskedForIsThatOfThePartsWithPoints) {
  const Inside is_missing = [](const Eigen::Vector3d& p) { return p[2] > 0.4; };
  const PointCloud scan = SphereWithout(12000, is_missing);
  ReconstructOptions options;
  options.control.boundary = BoundaryRule::kClose;
  options.encode.max_error = 1e-3;
  const auto made = Reconstruct(scan, options, RunContext{});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_FALSE(made->report.error_unreachable) << made->report.error.across_rms;
  EXPECT_GT(made->report.error.a_to_b.rms, 1e-2) << "nothing is filled";
  const DecodedSurface decoded = DecodeDss(made->encoded.Concatenate(), RunContext{}).value();
  EXPECT_TRUE(VerifyCertificate(decoded, &scan, RunContext{})->agrees());
}

}  // namespace
}  // namespace rilievo
