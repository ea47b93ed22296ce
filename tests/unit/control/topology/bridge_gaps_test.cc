#include "core/control/topology/bridge_gaps.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "core/geometry/mesh_topology.h"
#include "tests/unit/control/control_test_meshes.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

ControlMesh Bridged(const ControlMesh& mesh, double widest) {
  const auto bridged = BridgeGaps(mesh, widest, RunContext{});
  EXPECT_TRUE(bridged.ok()) << bridged.status();
  const TopologySummary summary = Summary(*bridged);
  EXPECT_TRUE(summary.manifold() && summary.oriented);
  EXPECT_EQ(bridged->vertices.leftCols(mesh.vertices.cols()), mesh.vertices);
  return *bridged;
}

double AreaOfFaces(const ControlMesh& mesh) {
  double area = 0;
  for (const auto face : mesh.faces.colwise()) {
    const Eigen::Vector3d a = mesh.vertices.col(face[0]);
    area += (mesh.vertices.col(face[1]) - a).cross(mesh.vertices.col(face[2]) - a).norm() / 2;
  }
  return area;
}

ControlMesh Moved(ControlMesh mesh, const Eigen::Vector3d& way) {
  mesh.vertices.colwise() += way;
  return mesh;
}

// The faces of a closed sphere whose middles are wanted.
template <typename Wanted>
ControlMesh SphereWhere(const Wanted& wanted) {
  const ControlMesh whole = MarchTetrahedra(SphereField, 40);
  std::vector<int> kept;
  for (int f = 0; f < whole.faces.cols(); ++f) {
    if (wanted(whole.vertices(Eigen::all, whole.faces.col(f)).rowwise().mean())) kept.push_back(f);
  }
  ControlMesh mesh;
  std::vector<int> number(static_cast<size_t>(whole.vertices.cols()), -1), used;
  mesh.faces = whole.faces(Eigen::all, kept);
  for (int& v : mesh.faces.reshaped()) {
    if (number[v] < 0) {
      number[v] = static_cast<int>(used.size());
      used.push_back(v);
    }
    v = number[v];
  }
  mesh.vertices = whole.vertices(Eigen::all, used);
  return mesh;
}

TEST(BridgeGapsTest, SheetsSideBySideBecomeOne) {
  // Of different cells, .03 apart.
  const ControlMesh apart =
      testing::Union(testing::Grid(41, 41), Moved(testing::Grid(31, 31), {1.03, 0, 0}));
  ASSERT_EQ(Summary(apart).components, 2);
  EXPECT_EQ(Bridged(apart, 0.02).faces.cols(), apart.faces.cols());
  const ControlMesh joined = Bridged(apart, 0.05);
  EXPECT_EQ(Summary(joined).components, 1);
  EXPECT_EQ(Summary(joined).boundary_loops, 1);
  EXPECT_NEAR(AreaOfFaces(joined), 2.03, 1e-9);
}

TEST(BridgeGapsTest, NewFacesAreAboutAsLargeAsThoseBeside) {
  const ControlMesh apart =
      testing::Union(testing::Grid(41, 41), Moved(testing::Grid(41, 41), {1.25, 0, 0}));
  const ControlMesh joined = Bridged(apart, 0.3);
  const auto fresh = static_cast<double>(joined.faces.cols() - apart.faces.cols());
  EXPECT_GT(fresh, 0.5 * 0.25 * 3200);
  EXPECT_LT(fresh, 1.5 * 0.25 * 3200);
  for (const double roundness : Roundnesses(joined)) EXPECT_GT(roundness, 0.15);
}

TEST(BridgeGapsTest, ABeltAroundASphereIsClosed) {
  const auto outside_belt = [](const Eigen::Vector3d& p) { return std::abs(p.z() - 0.1) > 0.03; };
  const ControlMesh apart = SphereWhere(outside_belt);
  ASSERT_EQ(Summary(apart).components, 2);
  const ControlMesh joined = Bridged(apart, 0.15);
  EXPECT_EQ(Summary(joined).components, 1);
  EXPECT_EQ(Summary(joined).boundary_loops, 0);
  EXPECT_EQ(Summary(joined).genus, 0);
}

// The same belt, but for a hole in it that is wider than the gaps.
TEST(BridgeGapsTest, WhatIsWiderStaysOpen) {
  const ControlMesh apart = SphereWhere([](const Eigen::Vector3d& p) {
    return std::abs(p.z()) > 0.03 && (p - Eigen::Vector3d(0.4, 0, 0)).norm() > 0.2;
  });
  ASSERT_EQ(Summary(apart).components, 2);
  const ControlMesh joined = Bridged(apart, 0.15);
  EXPECT_EQ(Summary(joined).components, 1);
  EXPECT_EQ(Summary(joined).boundary_loops, 1);
  EXPECT_EQ(Summary(joined).genus, 0);
}

TEST(BridgeGapsTest, PiecesInARowBecomeOne) {
  ControlMesh row = testing::Grid(21, 21);
  for (int i = 1; i < 4; ++i) {
    row = testing::Union(row, Moved(testing::Grid(21, 21), {1.04 * i, 0.01 * i, 0}));
  }
  const ControlMesh joined = Bridged(row, 0.08);
  EXPECT_EQ(Summary(joined).components, 1);
  EXPECT_EQ(Summary(joined).boundary_loops, 1);
}

TEST(BridgeGapsTest, OppositeSidesAreNotJoined) {
  ControlMesh turned = Moved(testing::Grid(21, 21), {1.03, 0, 0});
  turned.faces.row(1).swap(turned.faces.row(2));
  const ControlMesh apart = testing::Union(testing::Grid(21, 21), turned);
  EXPECT_EQ(Bridged(apart, 0.06).faces.cols(), apart.faces.cols());
}

TEST(BridgeGapsTest, ANarrowStripOfTheOppositeSideIsNotJoined) {
  ControlMesh strip = testing::Grid(21, 21);
  strip.vertices.row(0) = strip.vertices.row(0) * 0.04;
  strip = Moved(strip, {1.03, 0, 0});
  EXPECT_EQ(Summary(Bridged(testing::Union(testing::Grid(21, 21), strip), 0.05)).components, 1);
  strip.faces.row(1).swap(strip.faces.row(2));
  const ControlMesh apart = testing::Union(testing::Grid(21, 21), strip);
  EXPECT_EQ(Bridged(apart, 0.1).faces.cols(), apart.faces.cols());
}

// Of sheets above each other those that face apart are two sides of a plate.
TEST(BridgeGapsTest, SheetsAboveEachOtherBecomeAPlateOrStayApart) {
  const ControlMesh low = testing::Grid(21, 21), high = Moved(low, {0, 0, 0.04});
  const ControlMesh stack = testing::Union(low, high);
  EXPECT_EQ(Bridged(stack, 0.06).faces.cols(), stack.faces.cols());
  ControlMesh turned = low;
  turned.faces.row(1).swap(turned.faces.row(2));
  const ControlMesh plate = Bridged(testing::Union(turned, high), 0.06);
  EXPECT_EQ(Summary(plate).components, 1);
  EXPECT_EQ(Summary(plate).boundary_loops, 0);
  EXPECT_NEAR(AreaOfFaces(plate), 2.16, 1e-9);
}

// More vertices than are stitched at once, and not the same number on both sides.
TEST(BridgeGapsTest, LongWaysAreStitchedPieceByPiece) {
  for (const int rows : {101, 161, 250}) {
    const ControlMesh apart =
        testing::Union(testing::Grid(21, 161), Moved(testing::Grid(21, rows), {1.01, 0, 0}));
    const ControlMesh joined = Bridged(apart, 0.02);
    EXPECT_EQ(Summary(joined).components, 1) << rows;
    EXPECT_EQ(Summary(joined).boundary_loops, 1) << rows;
    EXPECT_NEAR(AreaOfFaces(joined), 2.01, 1e-9) << rows;
  }
}

// The width is that between borders, however far apart their vertices are.
TEST(BridgeGapsTest, LongEdgesAreNoWiderGaps) {
  const ControlMesh apart =
      testing::Union(testing::Grid(4, 4), Moved(testing::Grid(6, 6), {1.03, 0.02, 0}));
  EXPECT_EQ(Bridged(apart, 0.029).faces.cols(), apart.faces.cols());
  EXPECT_EQ(Summary(Bridged(apart, 0.04)).components, 1);
}

TEST(BridgeGapsTest, ManyPiecesAreJoinedInTimeThatGrowsWithThem) {
  ControlMesh tiles = testing::Grid(4, 4);
  constexpr int kSide = 14;
  for (int i = 1; i < kSide * kSide; ++i) {
    tiles = testing::Union(
        tiles,
        Moved(testing::Grid(4, 4), {1.05 * (i % kSide), 1.05 * static_cast<int>(i / kSide), 0}));
  }
  const ControlMesh joined = Bridged(tiles, 0.07);
  EXPECT_EQ(Summary(joined).components, 1);
  // A hole where four tiles meet.
  EXPECT_EQ(Summary(joined).boundary_loops, 1 + (kSide - 1) * (kSide - 1));
}

TEST(BridgeGapsTest, OnePieceIsLeftAlone) {
  const ControlMesh cylinder = OpenCylinder(24, 3);
  EXPECT_EQ(Bridged(cylinder, 10).faces.cols(), cylinder.faces.cols());
}

TEST(BridgeGapsTest, AStopIsHeard) {
  const ControlMesh apart =
      testing::Union(testing::Grid(5, 5), Moved(testing::Grid(5, 5), {1.1, 0, 0}));
  EXPECT_TRUE(absl::IsCancelled(BridgeGaps(apart, 0.2, Stopped()).status()));
}

}  // namespace
}  // namespace rilievo
