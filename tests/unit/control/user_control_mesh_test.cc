#include "core/control/user_control_mesh.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/control/spherical/octahedron.h"
#include "tests/unit/control/control_test_meshes.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

ControlMesh Ball() {
  const Octahedron octahedron(1);
  return {0.28 * octahedron.directions(), octahedron.faces()};
}

std::string Refusal(const ControlMesh& mesh) {
  const auto checked = CheckUserControlMesh(mesh, SphereCloud(1000), RunContext());
  EXPECT_EQ(checked.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(checked.status().message());
}

TEST(CheckUserControlMesh, TakesAGoodMeshAsItIs) {
  const auto checked = CheckUserControlMesh(Ball(), SphereCloud(1000), RunContext());
  ASSERT_TRUE(checked.ok()) << checked.status();
  EXPECT_EQ(checked->vertices, Ball().vertices);
  EXPECT_EQ(checked->faces, Ball().faces);
}

TEST(CheckUserControlMesh, NamesWhatIsWrong) {
  ControlMesh mesh = Ball();
  mesh.vertices(0, 3) = std::numeric_limits<double>::infinity();
  EXPECT_THAT(Refusal(mesh), HasSubstr("vertex 3 is not finite"));
  mesh = Ball();
  mesh.faces.resize(3, 0);
  EXPECT_THAT(Refusal(mesh), HasSubstr("0 faces"));
  mesh = Ball();
  std::swap(mesh.faces(0, 5), mesh.faces(1, 5));
  EXPECT_THAT(Refusal(mesh), HasSubstr("no orientable 2-manifold"));
  mesh = Ball();
  mesh.faces(0, 0) = 99;
  EXPECT_THAT(Refusal(mesh), HasSubstr("no orientable 2-manifold"));
}

TEST(CheckUserControlMesh, RefusesAMeshInOtherCoordinates) {
  ControlMesh mesh = Ball();
  mesh.vertices *= 1000;
  EXPECT_THAT(Refusal(mesh), HasSubstr("coordinates of the scan"));
  mesh = Ball();
  mesh.vertices.row(0).array() += 5;
  EXPECT_THAT(Refusal(mesh), HasSubstr("coordinates of the scan"));
}

// Two faces twenty times as large as the scan, as near to it as any: the distance is to them, and
// not to samples of them.
TEST(CheckUserControlMesh, MeasuresTheDistanceToLargeFaces) {
  ControlMesh sheets;
  sheets.vertices.resize(3, 6);
  sheets.vertices << -9, 9, 0, -9, 9, 0,  //
      -9, -9, 9, -9, -9, 9,               //
      0.15, 0.15, 0.15, -0.15, -0.15, -0.15;
  sheets.faces.resize(3, 2);
  sheets.faces << 0, 3, 1, 4, 2, 5;
  EXPECT_THAT(Refusal(sheets), HasSubstr("100 % of the points are within"));
}

// A cone over a fine ring: the cost of the fit grows with the square of its valence.
TEST(CheckUserControlMesh, RefusesAVertexOfManyEdges) {
  constexpr int kRing = 65;
  ControlMesh cone;
  cone.vertices.resize(3, kRing + 1);
  cone.vertices.col(kRing) << 0, 0, 0.5;
  cone.faces.resize(3, kRing);
  for (int i = 0; i < kRing; ++i) {
    const double angle = 2 * std::numbers::pi * i / kRing;
    cone.vertices.col(i) << 0.5 * std::cos(angle), 0.5 * std::sin(angle), 0;
    cone.faces.col(i) << i, (i + 1) % kRing, kRing;
  }
  EXPECT_THAT(Refusal(cone), HasSubstr("vertex 65 has 65 edges; at most 64"));
}

TEST(CheckUserControlMesh, RefusesAVertexFarAway) {
  ControlMesh mesh = Ball();
  const int first = static_cast<int>(mesh.vertices.cols());
  mesh.vertices.conservativeResize(3, first + 3);
  mesh.vertices.rightCols(3) = 1e6 * Eigen::Matrix3d::Identity();
  mesh.faces.conservativeResize(3, mesh.faces.cols() + 1);
  mesh.faces.rightCols(1) << first, first + 1, first + 2;
  EXPECT_THAT(Refusal(mesh), HasSubstr("lies 1000000 diagonals"));
}

TEST(CheckUserControlMesh, Stops) {
  EXPECT_EQ(CheckUserControlMesh(Ball(), SphereCloud(1000), Stopped()).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
