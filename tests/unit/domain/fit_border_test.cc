#include "core/domain/fit_border.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/loop/refinement.h"

namespace rilievo {
namespace {

// A fan around 0 in the plane z = 0.1, its border near the circle of radius 0.3.
ControlMesh Disc(int border) {
  ControlMesh disc;
  disc.vertices.resize(3, border + 1);
  disc.faces.resize(3, border);
  disc.vertices.col(0) << 0, 0, 0.1;
  for (int i = 0; i < border; ++i) {
    const double angle = 2 * std::numbers::pi * i / border, radius = i % 2 == 0 ? 0.29 : 0.31;
    disc.vertices.col(1 + i) << radius * std::cos(angle), radius * std::sin(angle),
        0.1 + 0.005 * std::sin(3 * angle);
    disc.faces.col(i) << 0, 1 + i, 1 + (i + 1) % border;
  }
  return disc;
}

Eigen::Matrix3Xd Polyline(const Eigen::Matrix3Xd& points) {
  Eigen::Matrix3Xd lines(3, 2 * points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    lines.col(2 * i) = points.col(i);
    lines.col(2 * i + 1) = points.col((i + 1) % points.cols());
  }
  return lines;
}

Eigen::Matrix3Xd BorderLimits(const ControlMesh& mesh) {
  const auto refinement = RefineTopology(mesh, 3, RunContext());
  const auto limit = EvaluateLimit(*refinement, mesh.vertices, 3, RunContext());
  Eigen::Matrix3Xd border(3, 0);
  for (int v = 0; v < refinement->levels.back().vertex_count; ++v) {
    if (refinement->levels.back().boundary_vertex[static_cast<size_t>(v)] == 0) continue;
    border.conservativeResize(3, border.cols() + 1);
    border.rightCols<1>() = limit->positions.col(v);
  }
  return border;
}

TEST(FitBorderTest, TheBorderBecomesACircleInItsPlane) {
  Eigen::Matrix3Xd circle(3, 5000);
  for (int i = 0; i < 5000; ++i) {
    const double angle = 2 * std::numbers::pi * i / 5000;
    circle.col(i) << 0.3 * std::cos(angle), 0.3 * std::sin(angle), 0.1;
  }
  ControlMesh disc = Disc(32);
  const Eigen::Vector3d middle = disc.vertices.col(0);
  ASSERT_TRUE(FitBorder({Polyline(circle), {}}, 1, RunContext(), &disc).ok());
  EXPECT_EQ(Eigen::Vector3d(disc.vertices.col(0)), middle);
  const Eigen::Matrix3Xd limits = BorderLimits(disc);
  for (const auto& point : limits.colwise()) {
    EXPECT_NEAR(point.z(), 0.1, 1e-13);
    EXPECT_NEAR(point.head<2>().norm(), 0.3, 2e-6);
  }
}

// The border of a disc and, in the other direction, that of what lies around it.
TEST(FitBorderTest, TheOtherSideOfANarrowGapIsNotFollowed) {
  constexpr int kSegments = 500;
  Eigen::Matrix3Xd lines(3, 4 * kSegments);
  for (const auto& [radius, first] : {std::pair(0.3, 0), std::pair(0.302, 2 * kSegments)}) {
    Eigen::Matrix3Xd circle(3, kSegments);
    for (int i = 0; i < kSegments; ++i) {
      const double angle = 2 * std::numbers::pi * (first == 0 ? i : -i) / kSegments;
      circle.col(i) << radius * std::cos(angle), radius * std::sin(angle), 0.1;
    }
    lines.middleCols<2 * kSegments>(first) = Polyline(circle);
  }
  ControlMesh disc = Disc(32);
  ASSERT_TRUE(FitBorder({lines, {}}, 1, RunContext(), &disc).ok());
  const Eigen::Matrix3Xd limits = BorderLimits(disc);
  for (const auto& point : limits.colwise()) EXPECT_NEAR(point.head<2>().norm(), 0.3, 1e-5);
}

TEST(FitBorderTest, CornersComeToThoseOfTheLines) {
  Eigen::Matrix3Xd square(3, 4);
  square << 0.22, -0.22, -0.22, 0.22, 0.22, 0.22, -0.22, -0.22, 0.1, 0.1, 0.1, 0.1;
  ControlMesh disc = Disc(32);
  for (const int corner : {5, 13, 21, 29}) disc.corners.push_back(corner);
  ASSERT_TRUE(FitBorder({Polyline(square), square}, 1, RunContext(), &disc).ok());
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_LT(
        (disc.vertices.col(disc.corners[i]) - square.col(static_cast<Eigen::Index>(i))).norm(),
        1e-8);
  }
  const Eigen::Matrix3Xd limits = BorderLimits(disc);
  for (const auto& point : limits.colwise()) {
    EXPECT_NEAR(point.head<2>().cwiseAbs().maxCoeff(), 0.22, 1e-6);
    EXPECT_NEAR(point.z(), 0.1, 1e-9);
  }
}

TEST(FitBorderTest, EdgesThatAreTooLongForTheLinesAreTold) {
  Eigen::Matrix3Xd wave(3, 4000);
  for (int i = 0; i < 4000; ++i) {
    const double angle = 2 * std::numbers::pi * i / 4000;
    // The left half waves more often than there are control points.
    const double radius = std::cos(angle) < 0 ? 0.3 + 0.01 * std::sin(40 * angle) : 0.3;
    wave.col(i) << radius * std::cos(angle), radius * std::sin(angle), 0.1;
  }
  ControlMesh disc = Disc(32);
  const auto miss = FitBorder({Polyline(wave), {}}, 1e-3, RunContext(), &disc);
  ASSERT_TRUE(miss.ok()) << miss.status();
  EXPECT_GE(miss->far.size(), 10u);
  EXPECT_LE(miss->far.size(), 18u);
  EXPECT_GT(miss->most, 5e-3);
  EXPECT_LT(miss->most, 1.2e-2);
  for (const auto& [a, b] : miss->far) {
    EXPECT_LT(std::min(disc.vertices(0, a), disc.vertices(0, b)), 0.01);
  }
}

TEST(FitBorderTest, ErrorsAreTold) {
  ControlMesh mesh = Disc(8);
  mesh.faces.col(1) = mesh.faces.col(0);
  EXPECT_EQ(
      FitBorder({Eigen::Matrix3Xd::Identity(3, 2), {}}, 1, RunContext(), &mesh).status().code(),
      absl::StatusCode::kInvalidArgument);
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  mesh = Disc(8);
  EXPECT_EQ(FitBorder({Eigen::Matrix3Xd::Identity(3, 2), {}}, 1, context, &mesh).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
