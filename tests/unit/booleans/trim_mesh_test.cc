#include "core/booleans/trim_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "tests/unit/booleans/solid_shapes.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

// Vertices by place: no two of them stand at the same one.
using PlaceOnBorder = std::array<double, 3>;
using BorderEdges = std::set<std::pair<PlaceOnBorder, PlaceOnBorder>>;

BorderEdges BorderOf(const TriangleMesh& mesh) {
  BorderEdges border;
  const auto place = [&](int v) {
    return PlaceOnBorder{mesh.vertices(0, v), mesh.vertices(1, v), mesh.vertices(2, v)};
  };
  for (const auto& t : mesh.triangles.colwise()) {
    for (int k = 0; k < 3; ++k) {
      const PlaceOnBorder from = place(t[k]), to = place(t[(k + 1) % 3]);
      if (border.erase({to, from}) == 0) border.insert({from, to});
    }
  }
  return border;
}

double TrimmedArea(const TriangleMesh& mesh) {
  double area = 0;
  for (const auto& t : mesh.triangles.colwise()) {
    const Eigen::Vector3d a = mesh.vertices.col(t[0]);
    area += (mesh.vertices.col(t[1]) - a).cross(mesh.vertices.col(t[2]) - a).norm() / 2;
  }
  return area;
}

struct Halves {
  TriangleMesh inside, outside;
};

// Both sides; what holds of every trim of a mesh without a border is checked.
Halves TrimBoth(const TriangleMesh& mesh, const TrimShape& shape) {
  Halves halves;
  for (const KeptSide side : {KeptSide::kInside, KeptSide::kOutside}) {
    const auto made = TrimMesh(mesh, shape, side, RunContext());
    EXPECT_TRUE(made.ok()) << made.status();
    if (!made.ok()) return halves;
    EXPECT_GT(made->cut_faces, 0);
    EXPECT_TRUE(
        BuildMeshTopology(made->mesh.triangles, static_cast<int>(made->mesh.vertices.cols())).ok());
    (side == KeptSide::kInside ? halves.inside : halves.outside) = made->mesh;
  }
  const double area = TrimmedArea(mesh);
  EXPECT_NEAR(TrimmedArea(halves.inside) + TrimmedArea(halves.outside), area, 1e-12 * area);
  BorderEdges turned;
  for (const auto& [from, to] : BorderOf(halves.outside)) turned.insert({to, from});
  EXPECT_EQ(BorderOf(halves.inside), turned);
  return halves;
}

// The largest distance of the border, edges and ends, from where `value` is zero.
template <typename Value>
double BorderError(const TriangleMesh& mesh, const Value& value) {
  double worst = 0;
  const BorderEdges border = BorderOf(mesh);
  EXPECT_FALSE(border.empty());
  for (const auto& [from, to] : border) {
    const Eigen::Map<const Eigen::Vector3d> a(from.data()), b(to.data());
    for (int i = 0; i <= 4; ++i) worst = std::max(worst, std::abs(value(a + i * (b - a) / 4)));
  }
  return worst;
}

TEST(TrimMeshTest, PlaneCutsASphereIntoCaps) {
  const TriangleMesh sphere = Moved(SphereMesh(5), Askew());
  const Eigen::Vector3d normal = Eigen::Vector3d(1, -2, 3);
  const Plane plane{normal, 0.3 * normal.norm()};
  const Halves halves = TrimBoth(sphere, plane);
  EXPECT_LT(BorderError(halves.inside,
                        [&](const Eigen::Vector3d& p) { return normal.normalized().dot(p) - 0.3; }),
            kTrimTolerance * 3.5);
  EXPECT_NEAR(TrimmedArea(halves.outside), 2 * std::numbers::pi * 0.7, 0.01);
}

TEST(TrimMeshTest, SphereCutsFlatFacesAlongItsCurve) {
  const TriangleMesh box = BoxMesh({0, 0, 0}, {2, 2, 2});
  const TrimSphere ball{{0.9, 1.1, 1.8}, 0.7};
  const Halves halves = TrimBoth(box, ball);
  const double diagonal = std::sqrt(12);
  EXPECT_LT(BorderError(halves.outside,
                        [&](const Eigen::Vector3d& p) { return (p - ball.center).norm() - 0.7; }),
            2 * kTrimTolerance * diagonal);
  EXPECT_NEAR(TrimmedArea(halves.inside), std::numbers::pi * (0.49 - 0.04), 1e-5);
}

TEST(TrimMeshTest, BoxCutsThroughItsEdgesAndCorners) {
  const TriangleMesh sphere = Moved(SphereMesh(4), Askew());
  const TrimBox box{{-2, -0.3, -2}, {0.2, 0.5, 0.4}};
  const Halves halves = TrimBoth(sphere, box);
  EXPECT_LT(BorderError(halves.inside,
                        [&](const Eigen::Vector3d& p) {
                          return std::max((box.low - p).maxCoeff(), (p - box.high).maxCoeff());
                        }),
            kTrimTolerance * 3.5);
  for (const auto& p : halves.inside.vertices.colwise()) {
    EXPECT_LT(std::max((box.low - p).maxCoeff(), (p - box.high).maxCoeff()), kTrimTolerance * 3.5);
  }
}

TEST(TrimMeshTest, PolylineMayBeConcave) {
  // An L, seen along an oblique direction, through the top and the bottom of a slab.
  TrimPrism prism{Eigen::Matrix3Xd(3, 6), {0.3, 0.2, -2}};
  prism.corners.row(0) << 0.5, 1.5, 1.5, 1.0, 1.0, 0.5;
  prism.corners.row(1) << 0.5, 0.5, 1.0, 1.0, 1.5, 1.5;
  prism.corners.row(2).setZero();
  const TriangleMesh slab = BoxMesh({0, 0, -0.25}, {2, 2, 0.25});
  for (const bool turned : {false, true}) {
    if (turned) prism.corners = prism.corners.rowwise().reverse().eval();
    const Halves halves = TrimBoth(slab, prism);
    EXPECT_NEAR(TrimmedArea(halves.inside), 2 * 0.75, 1e-12);
    EXPECT_EQ(SummarizeTopology(halves.outside.triangles,
                                static_cast<int>(halves.outside.vertices.cols()))
                  .boundary_loops,
              2);
  }
}

TEST(TrimMeshTest, ManyCornersSplitOnlyWhatTheirLinesMeet) {
  const TriangleMesh sphere = Moved(SphereMesh(5), Askew());
  for (const int count : {400, static_cast<int>(kMostPrismCorners)}) {
    TrimPrism prism{Eigen::Matrix3Xd(3, count), {0, 0, 1}};
    for (int i = 0; i < count; ++i) {
      const double turn = 2 * std::numbers::pi * i / count;
      prism.corners.col(i) << 0.8 * std::cos(turn), 0.8 * std::sin(turn), 0;
    }
    const Halves halves = TrimBoth(sphere, prism);
    EXPECT_LT(halves.inside.triangles.cols() + halves.outside.triangles.cols(),
              sphere.triangles.cols() + 20 * count);
    // Two caps, off the polygon by its sagitta at most.
    EXPECT_LT(BorderError(halves.inside,
                          [](const Eigen::Vector3d& p) { return p.head<2>().norm() - 0.8; }),
              0.8 * (1 - std::cos(std::numbers::pi / count)) + kTrimTolerance * 3.5);
    EXPECT_NEAR(TrimmedArea(halves.inside), 4 * std::numbers::pi * 0.4, 0.02);
    EXPECT_EQ(SummarizeTopology(halves.outside.triangles,
                                static_cast<int>(halves.outside.vertices.cols()))
                  .boundary_loops,
              2);
  }
}

TEST(TrimMeshTest, ManyCornersFitIntoOneFace) {
  TrimPrism prism{Eigen::Matrix3Xd(3, 300), {0, 0, 1}};
  for (int i = 0; i < 300; ++i) {
    const double turn = 2 * std::numbers::pi * i / 300, radius = i % 2 == 0 ? 0.5 : 0.4;
    prism.corners.col(i) << 1.2 + radius * std::cos(turn), 0.7 + radius * std::sin(turn), 0;
  }
  const Halves halves = TrimBoth(BoxMesh({0, 0, 0}, {2, 2, 2}), prism);
  EXPECT_NEAR(TrimmedArea(halves.inside), 300 * 0.5 * 0.4 * std::sin(std::numbers::pi / 150), 1e-9);
  EXPECT_LT(halves.inside.triangles.cols() + halves.outside.triangles.cols(), 20000);
}

TEST(TrimMeshTest, OpenMeshesKeepTheirOtherBorders) {
  const auto half = TrimMesh(SphereMesh(3), Plane{{0, 0, 1}, 0.1}, KeptSide::kInside, RunContext());
  ASSERT_TRUE(half.ok());
  const auto quarter =
      TrimMesh(half->mesh, Plane{{1, 0, 0}, 0.1}, KeptSide::kOutside, RunContext());
  ASSERT_TRUE(quarter.ok());
  const TopologySummary summary =
      SummarizeTopology(quarter->mesh.triangles, static_cast<int>(quarter->mesh.vertices.cols()));
  EXPECT_EQ(summary.boundary_loops, 1);
  EXPECT_EQ(summary.euler, 1);
  const auto capped =
      TrimSolid(half->mesh, Plane{{1, 0, 0}, 0.1}, KeptSide::kOutside, RunContext());
  EXPECT_EQ(capped.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(capped.status().message()), HasSubstr("the mesh is open"));
}

TEST(TrimMeshTest, VerticesOnTheShapeSplitNothing) {
  const auto half = TrimMesh(SphereMesh(2), Plane{{0, 0, 1}, 0}, KeptSide::kOutside, RunContext());
  ASSERT_TRUE(half.ok());
  EXPECT_EQ(half->cut_faces, 0);
  EXPECT_EQ(half->mesh.triangles.cols(), SphereMesh(2).triangles.cols() / 2);
}

TEST(TrimMeshTest, TooManyTrianglesAreRefused) {
  const TriangleMesh box = BoxMesh({0, 0, 0}, {2, 2, 2});
  const TrimSphere ball{{1, 1, 2}, 0.7};
  const auto made = TrimMesh(box, ball, KeptSide::kInside, RunContext());
  ASSERT_TRUE(made.ok()) << made.status();
  ASSERT_GT(made->mesh.triangles.cols(), 100);
  const auto refused = TrimMesh(box, ball, KeptSide::kInside, RunContext(), 100);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(refused.status().message()),
              HasSubstr("more than 100 triangles; take a shape that meets less"));
}

TEST(TrimMeshTest, SolidsAreClosedAlongTheShape) {
  const TriangleMesh block = BoxMesh({0, 0, 0}, {2, 2, 2});
  TrimPrism prism{Eigen::Matrix3Xd(3, 3), {0, 0, 1}};
  prism.corners << 0.5, 1.5, 0.5, 0.5, 0.5, 1.5, 9, 9, 9;
  const double ball = 4 * std::numbers::pi / 3 * 0.008;
  const std::pair<TrimShape, double> shapes[] = {{Plane{{0, 0, 2}, 1}, 2},
                                                 {TrimBox{{-1, 1, 0.5}, {0.5, 3, 1.5}}, 0.5},
                                                 {TrimSphere{{1, 1, 1}, 0.2}, ball},
                                                 {prism, 1}};
  for (const auto& [shape, inside] : shapes) {
    const auto kept = TrimSolid(block, shape, KeptSide::kInside, RunContext()),
               rest = TrimSolid(block, shape, KeptSide::kOutside, RunContext());
    ASSERT_TRUE(kept.ok()) << kept.status();
    ASSERT_TRUE(rest.ok()) << rest.status();
    EXPECT_TRUE(BorderOf(kept->mesh).empty());
    EXPECT_NEAR(VolumeOf(kept->mesh), inside, 1e-5);
    EXPECT_NEAR(VolumeOf(rest->mesh), 8 - inside, 1e-5);
  }
}

TEST(TrimMeshTest, WhatIsNoShapeIsRefused) {
  const TriangleMesh box = BoxMesh({0, 0, 0}, {1, 1, 1});
  TrimPrism crossed{Eigen::Matrix3Xd(3, 4), {0, 0, 1}};
  crossed.corners << 0, 1, 0, 1, 0, 1, 1, 0, 0, 0, 0, 0;
  TrimPrism few{Eigen::Matrix3Xd::Zero(3, 2), {0, 0, 1}};
  const std::pair<TrimShape, const char*> cases[] = {
      {Plane{{0, 0, 0}, 1}, "normal"},
      {TrimBox{{0, 0, 0}, {1, 0, 1}}, "two corners"},
      {TrimSphere{{0, 0, 0}, -1}, "radius"},
      {crossed, "corners 1 and 3 meet"},
      {few, "it has 2 corners"},
  };
  for (const auto& [shape, words] : cases) {
    const auto made = TrimMesh(box, shape, KeptSide::kInside, RunContext());
    EXPECT_EQ(made.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(made.status().message()), HasSubstr(words));
  }
  const auto none = TrimMesh(box, Plane{{0, 0, 1}, -1}, KeptSide::kInside, RunContext());
  EXPECT_EQ(none.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(none.status().message()), HasSubstr("nothing is left"));
}

TEST(TrimMeshTest, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  const auto made = TrimMesh(SphereMesh(3), Plane{{0, 0, 1}, 0.1}, KeptSide::kInside, context);
  EXPECT_EQ(made.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
