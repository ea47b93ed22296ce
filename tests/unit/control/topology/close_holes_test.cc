#include "core/control/topology/close_holes.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "core/geometry/mesh_topology.h"
#include "tests/unit/control/control_test_meshes.h"
#include "tests/unit/geometry/test_meshes.h"

namespace rilievo {
namespace {

ControlMesh Closed(const ControlMesh& mesh, double longest_rim) {
  const auto closed = CloseHoles(mesh, longest_rim, RunContext{});
  EXPECT_TRUE(closed.ok()) << closed.status();
  EXPECT_TRUE(
      BuildMeshTopology(closed->faces, static_cast<int>(closed->vertices.cols())).status().ok());
  return *closed;
}

double AreaOf(const ControlMesh& mesh) {
  double area = 0;
  for (const auto face : mesh.faces.colwise()) {
    const Eigen::Vector3d a = mesh.vertices.col(face[0]);
    area += (mesh.vertices.col(face[1]) - a).cross(mesh.vertices.col(face[2]) - a).norm() / 2;
  }
  return area;
}

// The unit square without the cells whose middles lie within squares of `half` width around places.
ControlMesh SquareWithHoles(const std::vector<std::pair<Eigen::Vector2d, double>>& holes) {
  ControlMesh mesh = testing::Grid(41, 41);
  std::vector<int> kept;
  for (int f = 0; f < mesh.faces.cols(); ++f) {
    const Eigen::Vector3d middle = mesh.vertices(Eigen::all, mesh.faces.col(f)).rowwise().mean();
    bool is_in_hole = false;
    for (const auto& [place, half] : holes) {
      is_in_hole |= (middle.head<2>() - place).cwiseAbs().maxCoeff() < half;
    }
    if (!is_in_hole) kept.push_back(f);
  }
  mesh.faces = Eigen::Matrix3Xi(mesh.faces(Eigen::all, kept));
  std::vector<int> number(static_cast<size_t>(mesh.vertices.cols()), -1), used;
  for (int& v : mesh.faces.reshaped()) {
    if (number[v] < 0) {
      number[v] = static_cast<int>(used.size());
      used.push_back(v);
    }
    v = number[v];
  }
  mesh.vertices = Eigen::Matrix3Xd(mesh.vertices(Eigen::all, used));
  return mesh;
}

TEST(CloseHolesTest, HolesWithAShorterRimAreClosedAndTheOuterBorderStays) {
  // Rims of .8 and 1.6; the border of the square is 4 long.
  const ControlMesh open = SquareWithHoles({{{0.2, 0.2}, 0.1}, {{0.6, 0.6}, 0.2}});
  ASSERT_EQ(Summary(open).boundary_loops, 3);
  EXPECT_EQ(Closed(open, 0.79).faces.cols(), open.faces.cols());
  const ControlMesh one = Closed(open, 1);
  EXPECT_EQ(Summary(one).boundary_loops, 2);
  EXPECT_NEAR(AreaOf(one), 1 - 0.16, 1e-9);
  const ControlMesh both = Closed(open, 100);
  EXPECT_EQ(Summary(both).boundary_loops, 1);
  EXPECT_NEAR(AreaOf(both), 1, 1e-9);
}

TEST(CloseHolesTest, NewFacesAreAboutAsLargeAsThoseAround) {
  const ControlMesh open = SquareWithHoles({{{0.5, 0.5}, 0.25}});
  const ControlMesh closed = Closed(open, 3);
  const double fresh = static_cast<double>(closed.faces.cols() - open.faces.cols());
  EXPECT_GT(fresh, 0.5 * 0.25 * 3200);
  EXPECT_LT(fresh, 1.5 * 0.25 * 3200);
  for (const double roundness : Roundnesses(closed)) EXPECT_GT(roundness, 0.2);
}

TEST(CloseHolesTest, ManyNewFacesAreLargerInstead) {
  const ControlMesh open = SquareWithHoles({{{0.5, 0.5}, 0.45}});
  const ControlMesh closed = Closed(open, 4);
  EXPECT_EQ(Summary(closed).boundary_loops, 1);
  EXPECT_LT(closed.faces.cols(), 2 * open.faces.cols());
}

TEST(CloseHolesTest, APipeIsClosedAtBothEnds) {
  const ControlMesh pipe = OpenCylinder(24, 20);
  EXPECT_EQ(Summary(Closed(pipe, 1.2)).boundary_loops, 2);
  const ControlMesh closed = Closed(pipe, 1.3);
  EXPECT_TRUE(Summary(closed).closed());
  EXPECT_EQ(Summary(closed).euler, 2);
  // Two discs more, of 24 corners each.
  const double disc = 12 * 0.04 * std::sin(std::numbers::pi / 12);
  EXPECT_NEAR(AreaOf(closed), AreaOf(pipe) + 2 * disc, 1e-3);
}

// Two tall tents back to back over an edge, whose feet are the rim: to join the ends of that edge
// once more takes the least area.
TEST(CloseHolesTest, NoEdgeIsMadeTwice) {
  ControlMesh tents;
  tents.vertices.resize(3, 6);
  tents.vertices << 0, 1, 0, -1, 0.3, -0.3,  //
      -0.1, 0, 0.1, 0, 0, 0,                 //
      0, 0, 0, 0, 3, 3;
  tents.faces = testing::Faces({{0, 1, 4}, {1, 2, 4}, {2, 0, 4}, {0, 2, 5}, {2, 3, 5}, {3, 0, 5}});
  ASSERT_EQ(Summary(tents).boundary_loops, 1);
  EXPECT_TRUE(Summary(Closed(tents, 100)).closed());
}

TEST(CloseHolesTest, CreasesAndVerticesKeepTheirNumbers) {
  ControlMesh open = SquareWithHoles({{{0.5, 0.5}, 0.2}});
  open.creases = {{open.faces(0, 0), open.faces(1, 0), kInfiniteSharpness}};
  if (open.creases[0].a > open.creases[0].b) std::swap(open.creases[0].a, open.creases[0].b);
  const ControlMesh closed = Closed(open, 3);
  EXPECT_EQ(closed.creases, open.creases);
  EXPECT_EQ(closed.vertices.leftCols(open.vertices.cols()), open.vertices);
}

TEST(CloseHolesTest, StopsWhenAsked) {
  EXPECT_TRUE(
      absl::IsCancelled(CloseHoles(SquareWithHoles({{{0.5, 0.5}, 0.2}}), 3, Stopped()).status()));
}

}  // namespace
}  // namespace rilievo
