#include "core/control/creases/sharp_edges.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <numbers>
#include <stop_token>

#include "tests/scans/random.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kEdgeSpacing = 0.01;

// A lens over a flat outline of `count` points: two fans that meet along it.
ControlMesh Lens(const Eigen::Matrix3Xd& outline, double height) {
  const auto count = static_cast<int>(outline.cols());
  ControlMesh mesh;
  mesh.vertices.resize(3, count + 2);
  mesh.vertices.leftCols(count) = outline;
  mesh.vertices.rightCols<2>() << 0, 0, 0, 0, height, -height;
  mesh.faces.resize(3, 2 * count);
  for (int i = 0; i < count; ++i) {
    mesh.faces.col(2 * i) << i, (i + 1) % count, count;
    mesh.faces.col(2 * i + 1) << (i + 1) % count, i, count + 1;
  }
  return mesh;
}

Eigen::Matrix3Xd Circle(int count, double radius) {
  Eigen::Matrix3Xd points(3, count);
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * i / count;
    points.col(i) << radius * std::cos(angle), radius * std::sin(angle), 0;
  }
  return points;
}

TEST(SharpEdgesTest, ABoxHasTwelve) {
  ControlMesh box = testing::Box({0, 0, 0}, {0.3, 0.4, 0.5});
  ASSERT_TRUE(TagSharpEdges(kEdgeSpacing, RunContext(), &box).ok());
  EXPECT_EQ(box.creases.size(), 12u);
  EXPECT_TRUE(box.corners.empty());  // three creases make one
}

TEST(SharpEdgesTest, TheRimOfALensIsALineWithoutCorners) {
  ControlMesh lens = Lens(Circle(96, 0.3), 0.1);
  ASSERT_TRUE(TagSharpEdges(kEdgeSpacing, RunContext(), &lens).ok());
  ASSERT_EQ(lens.creases.size(), 96u);
  for (const Crease& crease : lens.creases) EXPECT_LT(crease.b, 96);
  EXPECT_TRUE(lens.corners.empty());
}

// A circle with a tip at angle 0.
TEST(SharpEdgesTest, ALineThatTurnsHasACorner) {
  Eigen::Matrix3Xd outline = Circle(96, 0.3);
  outline.col(0) << 0.45, 0, 0;
  for (int i = 1; i <= 12; ++i) {
    const double part = i / 12.0;
    for (const int at : {i, 96 - i}) {
      const double side = at < 48 ? 1 : -1;
      const Vector3d foot(0.3 * std::cos(std::numbers::pi / 4),
                          side * 0.3 * std::sin(std::numbers::pi / 4), 0);
      outline.col(at) = (1 - part) * outline.col(0) + part * foot;
    }
  }
  ControlMesh lens = Lens(outline, 0.05);
  ASSERT_TRUE(TagSharpEdges(kEdgeSpacing, RunContext(), &lens).ok());
  EXPECT_EQ(lens.creases.size(), 96u);
  EXPECT_EQ(lens.corners, std::vector<int>{0});
}

// A gear of so many teeth, two corners each; CPU seconds that its tags take.
double TagGear(int teeth) {
  const double radius = 2 * kEdgeSpacing * teeth / std::numbers::pi;  // a corner in two spacings
  Eigen::Matrix3Xd outline = Circle(2 * teeth, radius);
  for (int i = 1; i < 2 * teeth; i += 2) outline.col(i) *= 1 - 3 * kEdgeSpacing / radius;
  ControlMesh gear = Lens(outline, 0.02 * radius);
  const std::clock_t start = std::clock();
  EXPECT_TRUE(TagSharpEdges(kEdgeSpacing, RunContext(), &gear).ok());
  const std::clock_t end = std::clock();
  EXPECT_EQ(gear.creases.size(), 2u * teeth);
  EXPECT_EQ(gear.corners.size(), 2u * teeth);
  return static_cast<double>(end - start) / CLOCKS_PER_SEC;
}

TEST(SharpEdgesTest, TheTimeGrowsWithTheNumberOfCorners) {
  TagGear(1000);
  EXPECT_LT(TagGear(16'000), 24 * TagGear(2000));  // 8 times as many
}

TEST(SharpEdgesTest, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  ControlMesh box = testing::Box({0, 0, 0}, {0.3, 0.4, 0.5});
  EXPECT_TRUE(absl::IsCancelled(TagSharpEdges(kEdgeSpacing, context, &box)));
}

TEST(SharpEdgesTest, SmoothAndNoisyMeshesHaveNone) {
  ControlMesh smooth = testing::Torus(60, 40);
  ASSERT_TRUE(TagSharpEdges(kEdgeSpacing, RunContext(), &smooth).ok());
  EXPECT_TRUE(smooth.creases.empty());
  ControlMesh noisy = smooth;
  Random random(3);
  for (auto vertex : noisy.vertices.colwise()) {
    vertex += 0.03 * Vector3d(random.Normal(), random.Normal(), random.Normal());
  }
  ASSERT_TRUE(TagSharpEdges(kEdgeSpacing, RunContext(), &noisy).ok());
  EXPECT_TRUE(noisy.creases.empty());
}

TEST(SharpEdgesTest, ATriangleTooThinForAPlaneTakesThatOfItsNeighbor) {
  // On an edge of a box a vertex that rounding has moved aside, and with it a sliver.
  ControlMesh box = testing::Box({0, 0, 0}, {0.3, 0.4, 0.5});
  const auto count = static_cast<int>(box.vertices.cols());
  const int a = box.faces(0, 0), b = box.faces(1, 0), c = box.faces(2, 0);
  const Vector3d normal = Vector3d(box.vertices.col(b) - box.vertices.col(a))
                              .cross(Vector3d(box.vertices.col(c) - box.vertices.col(a)))
                              .normalized();
  box.vertices.conservativeResize(3, count + 1);
  box.vertices.col(count) = (box.vertices.col(a) + box.vertices.col(b)) / 2 + 1e-9 * normal +
                            1e-9 * (box.vertices.col(c) - box.vertices.col(a));
  box.faces.conservativeResize(3, box.faces.cols() + 2);
  box.faces.col(0) << a, count, c;
  const auto last = box.faces.cols() - 1;
  box.faces.col(last - 1) << a, b, count;
  box.faces.col(last) << b, c, count;
  ASSERT_TRUE(TagSharpEdges(kEdgeSpacing, RunContext(), &box).ok());
  EXPECT_GE(box.creases.size(), 12u);
  EXPECT_LE(box.creases.size(), 13u);
}

}  // namespace
}  // namespace rilievo
