#include "core/meshes/check_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/geometry/mesh_topology.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

using testing::Faces;

PointCloud MeshOf(const ControlMesh& mesh) { return {mesh.vertices, {}, mesh.faces}; }

// A corner of its own for each triangle, as in STL.
PointCloud Soup(const ControlMesh& mesh) {
  PointCloud soup;
  soup.points = mesh.vertices(Eigen::all, mesh.faces.reshaped());
  soup.triangles = Eigen::VectorXi::LinSpaced(static_cast<Eigen::Index>(soup.points.cols()), 0,
                                              static_cast<int>(soup.points.cols()) - 1)
                       .reshaped(3, mesh.faces.cols());
  return soup;
}

// The unit cube at a place.
ControlMesh Cube(const Eigen::Vector3d& at) {
  return testing::Box(at, at + Eigen::Vector3d::Ones());
}

double Volume(const CheckedMesh& mesh) {
  double sum = 0;
  for (const auto face : mesh.triangles.colwise()) {
    sum += mesh.vertices.col(face[0]).dot(
        mesh.vertices.col(face[1]).cross(mesh.vertices.col(face[2])));
  }
  return sum / 6;
}

TopologySummary SummaryOf(const CheckedMesh& mesh) {
  const int count = static_cast<int>(mesh.vertices.cols());
  EXPECT_TRUE(BuildMeshTopology(mesh.triangles, count).ok())
      << BuildMeshTopology(mesh.triangles, count).status();
  EXPECT_EQ(mesh.source_vertex.size(), static_cast<size_t>(count));
  return SummarizeTopology(mesh.triangles, count);
}

TEST(CheckMeshTest, AManifoldStaysAsItIs) {
  const CheckedMesh mesh = CheckMesh(MeshOf(testing::Torus(12, 8)), RunContext{}).value();
  EXPECT_EQ(mesh.triangles.cols(), testing::Torus(12, 8).faces.cols());
  EXPECT_EQ(SummaryOf(mesh).genus, 1);
  EXPECT_EQ(mesh.figures.opened_edges, 0);
  EXPECT_EQ(mesh.figures.flipped, 0);
  EXPECT_EQ(mesh.figures.dropped, 0);
  EXPECT_EQ(mesh.figures.welded_vertices, 0);
}

TEST(CheckMeshTest, ASoupIsWelded) {
  const CheckedMesh mesh = CheckMesh(Soup(testing::Torus(12, 8)), RunContext{}).value();
  EXPECT_EQ(mesh.vertices.cols(), testing::Torus(12, 8).vertices.cols());
  EXPECT_EQ(SummaryOf(mesh).genus, 1);
  EXPECT_EQ(mesh.figures.welded_vertices, 3 * mesh.triangles.cols() - mesh.vertices.cols());
}

TEST(CheckMeshTest, TurnedTrianglesAreTurnedBack) {
  PointCloud mesh = MeshOf(testing::Torus(12, 8));
  const CheckedMesh right = CheckMesh(mesh, RunContext{}).value();
  for (const int t : {0, 5, 17, 40}) std::swap(mesh.triangles(0, t), mesh.triangles(1, t));
  const CheckedMesh mended = CheckMesh(mesh, RunContext{}).value();
  EXPECT_EQ(mended.figures.flipped, 4);
  EXPECT_TRUE(SummaryOf(mended).oriented);
  EXPECT_NEAR(Volume(mended), Volume(right), 1e-12);
}

TEST(CheckMeshTest, AClosedPieceThatDoesNotAgreeFacesOutwards) {
  PointCloud mesh = MeshOf(testing::Icosahedron());
  for (int t = 0; t < 13; ++t) std::swap(mesh.triangles(0, t), mesh.triangles(1, t));
  const CheckedMesh mended = CheckMesh(mesh, RunContext{}).value();
  EXPECT_EQ(mended.figures.flipped, 13);
  EXPECT_GT(Volume(mended), 0);
  // One that agrees with itself may be a void.
  for (int t = 13; t < 20; ++t) std::swap(mesh.triangles(0, t), mesh.triangles(1, t));
  EXPECT_LT(Volume(CheckMesh(mesh, RunContext{}).value()), 0);
}

TEST(CheckMeshTest, PiecesWithoutAreaAreDropped) {
  ControlMesh both = testing::Icosahedron();
  const auto first = static_cast<int>(both.vertices.cols());
  const Eigen::Index faces = both.faces.cols();
  both.vertices.conservativeResize(3, first + 3);
  both.vertices.rightCols(3) << 5, 6, 8, 5, 6, 8, 5, 6, 8;
  both.faces.conservativeResize(3, faces + 1);
  both.faces.col(faces) << first, first + 1, first + 2;
  const CheckedMesh mesh = CheckMesh(MeshOf(both), RunContext{}).value();
  EXPECT_EQ(mesh.figures.dropped, 1);
  EXPECT_EQ(SummaryOf(mesh).components, 1);
  EXPECT_EQ(SummaryOf(mesh).boundary_loops, 0);
}

TEST(CheckMeshTest, SolidsThatShareAnEdgeAreApart) {
  // Diagonal neighbours, so that two cubes have one edge in common.
  const ControlMesh both = testing::Union(Cube({0, 0, 0}), Cube({1, 1, 0}));
  const CheckedMesh mesh = CheckMesh(MeshOf(both), RunContext{}).value();
  const TopologySummary summary = SummaryOf(mesh);
  EXPECT_EQ(summary.components, 2);
  EXPECT_EQ(summary.boundary_loops, 0);
  EXPECT_EQ(mesh.figures.opened_edges, 1);
  EXPECT_EQ(mesh.figures.welded_vertices, 2);
  EXPECT_EQ(mesh.figures.flipped, 0);
}

TEST(CheckMeshTest, SolidsThatShareAVertexAreApart) {
  const ControlMesh both = testing::Union(Cube({0, 0, 0}), Cube({1, 1, 1}));
  const CheckedMesh mesh = CheckMesh(MeshOf(both), RunContext{}).value();
  EXPECT_EQ(SummaryOf(mesh).components, 2);
  EXPECT_EQ(mesh.vertices.cols(), 16);
}

// Two cubes with a face in common, and one of its triangles once more.
TEST(CheckMeshTest, OppositeTrianglesStayOrGo) {
  const ControlMesh both = testing::Union(Cube({0, 0, 0}), Cube({1, 0, 0}));
  const CheckedMesh one = CheckMesh(MeshOf(both), RunContext{}, OppositeTriangles::kNone).value();
  EXPECT_EQ(one.figures.dropped, 4);
  EXPECT_EQ(SummaryOf(one).components, 1);
  EXPECT_TRUE(SummaryOf(one).closed());
  EXPECT_NEAR(Volume(one) * std::pow(one.frame.diagonal, 3), 2, 1e-9);
  EXPECT_EQ(CheckMesh(MeshOf(both), RunContext{}).value().figures.dropped, 2);
  PointCloud thrice = MeshOf(Cube({0, 0, 0}));
  thrice.triangles.conservativeResize(3, 14);
  thrice.triangles.col(12) = thrice.triangles.col(0);
  thrice.triangles.col(13) = thrice.triangles.col(0).reverse();
  const CheckedMesh same = CheckMesh(thrice, RunContext{}, OppositeTriangles::kNone).value();
  EXPECT_EQ(same.figures.dropped, 2);
  EXPECT_EQ(same.figures.flipped, 0);
  EXPECT_TRUE(SummaryOf(same).closed());
}

TEST(CheckMeshTest, AWallOnAFloorIsASheetOfItsOwn) {
  // A floor of four triangles around the edge from 0 to 1, and a wall on that edge that goes on
  // beyond it on neither side.
  PointCloud mesh;
  mesh.points.resize(3, 6);
  mesh.points << 0, 1, 0.5, 0.5, 0.5, 0.5, 0, 0, 1, -1, 0, 0, 0, 0, 0, 0, 1, 2;
  mesh.triangles = Faces({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  const CheckedMesh checked = CheckMesh(mesh, RunContext{}).value();
  const TopologySummary summary = SummaryOf(checked);
  EXPECT_EQ(checked.figures.opened_edges, 1);
  EXPECT_EQ(summary.components, 2);
  EXPECT_EQ(summary.boundary_loops, 2);
}

TEST(CheckMeshTest, ASecondEdgeBetweenTwoVerticesGetsAMiddle) {
  // Around 0 and around 1 the triangles hang together, but the edge from 0 to 1 has three.
  PointCloud mesh;
  mesh.points.resize(3, 5);
  mesh.points << 0, 1, 0.5, 0.5, 0.5, 0, 0, 1, -1, 0, 0, 0, 0, 0, 1;
  mesh.triangles = Faces({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}, {0, 4, 2}, {4, 1, 2}});
  const CheckedMesh checked = CheckMesh(mesh, RunContext{}).value();
  SummaryOf(checked);
  EXPECT_GE(checked.triangles.cols(), 5);
}

TEST(CheckMeshTest, AMoebiusStripIsCutOnce) {
  PointCloud mesh;
  const int n = 20;
  mesh.points.resize(3, 2 * n);
  mesh.triangles.resize(3, 2 * n);
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * std::numbers::pi * i / n, turn = angle / 2;
    for (int side : {0, 1}) {
      const double r = 2 + (side - 0.5) * std::cos(turn);
      mesh.points.col(2 * i + side) << r * std::cos(angle), r * std::sin(angle),
          (side - 0.5) * std::sin(turn);
    }
    const bool last = i + 1 == n;
    const int a = 2 * i, b = 2 * i + 1;
    const int c = last ? 1 : 2 * i + 2, d = last ? 0 : 2 * i + 3;
    mesh.triangles.col(2 * i) << a, c, b;
    mesh.triangles.col(2 * i + 1) << b, c, d;
  }
  const CheckedMesh strip = CheckMesh(mesh, RunContext{}).value();
  const TopologySummary summary = SummaryOf(strip);
  EXPECT_EQ(strip.figures.opened_edges, 1);
  EXPECT_EQ(summary.components, 1);
  EXPECT_EQ(summary.boundary_loops, 1);  // a plain strip now
  EXPECT_EQ(summary.euler, 1);
}

TEST(CheckMeshTest, WhatIsNoTriangleIsDropped) {
  PointCloud mesh = MeshOf(testing::Icosahedron());
  const Eigen::Index faces = mesh.triangles.cols();
  mesh.points.conservativeResize(3, mesh.points.cols() + 1);
  mesh.points.rightCols(1).setConstant(std::numeric_limits<double>::quiet_NaN());
  mesh.triangles.conservativeResize(3, faces + 3);
  mesh.triangles.col(faces) << 0, 1, 1;
  mesh.triangles.col(faces + 1) << 0, 1, static_cast<int>(mesh.points.cols()) - 1;
  mesh.triangles.col(faces + 2) = mesh.triangles.col(3);
  const CheckedMesh checked = CheckMesh(mesh, RunContext{}).value();
  EXPECT_EQ(checked.figures.dropped, 3);
  EXPECT_EQ(checked.figures.triangles_used, faces);
  EXPECT_EQ(SummaryOf(checked).boundary_loops, 0);
}

TEST(CheckMeshTest, RefusesWhatIsNoMesh) {
  PointCloud mesh = MeshOf(testing::Tetrahedron());
  mesh.triangles(1, 2) = 4;
  EXPECT_THAT(CheckMesh(mesh, RunContext{}).status().message(),
              ::testing::HasSubstr("triangle 2 names vertex 4; there are the vertices 0 to 3"));
  mesh.triangles(1, 2) = -1;
  EXPECT_EQ(CheckMesh(mesh, RunContext{}).status().code(), absl::StatusCode::kInvalidArgument);
  mesh = MeshOf(testing::Tetrahedron());
  mesh.points.row(0).setZero();
  mesh.points.row(1).setZero();  // all on a line
  EXPECT_THAT(CheckMesh(mesh, RunContext{}).status().message(), ::testing::HasSubstr("triangles:"));
  mesh.triangles.resize(3, 0);
  EXPECT_EQ(CheckMesh(mesh, RunContext{}).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST(CheckMeshTest, RandomTrianglesBecomeAManifold) {
  testing::Random random(7);
  for (int trial = 0; trial < 200; ++trial) {
    PointCloud mesh;
    const int vertices = 5 + random.Below(8), triangles = 1 + random.Below(30);
    mesh.points.resize(3, vertices);
    for (auto point : mesh.points.colwise()) point = random.Vector();
    mesh.triangles.resize(3, triangles);
    for (int& corner : mesh.triangles.reshaped()) corner = random.Below(vertices);
    const auto checked = CheckMesh(mesh, RunContext{});
    if (!checked.ok()) continue;
    EXPECT_TRUE(SummaryOf(*checked).manifold()) << "trial " << trial;
  }
}

}  // namespace
}  // namespace rilievo
