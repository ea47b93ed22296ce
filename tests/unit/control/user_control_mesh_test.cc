#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/control/control_roads.h"
#include "core/control/octahedron.h"
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

TEST(CheckUserControlMesh, Stops) {
  EXPECT_EQ(CheckUserControlMesh(Ball(), SphereCloud(1000), Stopped()).status().code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
