#include "core/codec/mesh/prepare_control_mesh.h"

#include <algorithm>
#include <array>

#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using Triangle = std::array<std::array<double, 3>, 3>;

// The faces as triangles in space, each turned to a first corner of its own, sorted.
std::vector<Triangle> Soup(const ControlMesh& mesh) {
  std::vector<Triangle> soup;
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    Triangle triangle;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d p = mesh.vertices.col(mesh.faces(k, f));
      triangle[k] = {p[0], p[1], p[2]};
    }
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()),
                triangle.end());
    soup.push_back(triangle);
  }
  std::sort(soup.begin(), soup.end());
  return soup;
}

std::vector<ControlMesh> Meshes() {
  return {Octahedron(), Torus(9, 7), Sheet(6, 8, true),
          Together(Torus(5, 4), Sheet(4, 4, false), {0, 0, 1})};
}

TEST(PrepareControlMeshTest, CanonicalOrderKeepsEveryTriangle) {
  for (const ControlMesh& mesh : Meshes()) {
    for (uint64_t seed = 0; seed < 5; ++seed) {
      const ControlMesh shuffled = Shuffled(mesh, seed);
      const auto canonical = CanonicalControlMesh(shuffled);
      ASSERT_TRUE(canonical.ok()) << canonical.status();
      EXPECT_EQ(Soup(*canonical), Soup(mesh));
    }
  }
}

TEST(PrepareControlMeshTest, IsIdempotent) {
  for (const ControlMesh& mesh : Meshes()) {
    for (double step : {1e-7, 1e-4, 3e-3}) {
      const ControlMesh once = *PrepareControlMesh(Shuffled(mesh, 9), step);
      const ControlMesh twice = *PrepareControlMesh(once, step);
      EXPECT_EQ(once.vertices, twice.vertices);
      EXPECT_EQ(once.faces, twice.faces);
    }
  }
}

TEST(PrepareControlMeshTest, OrderIgnoresWhereThePointsAre) {
  ControlMesh moved = Torus(9, 7);
  const ControlMesh canonical = *CanonicalControlMesh(moved);
  for (Eigen::Index v = 0; v < moved.vertices.cols(); ++v) moved.vertices.col(v) *= MixedUnit(v);
  EXPECT_EQ(CanonicalControlMesh(moved)->faces, canonical.faces);
}

TEST(PrepareControlMeshTest, MovesNoPointByMoreThanHalfAStep) {
  const ControlMesh mesh = Torus(9, 7);
  const double step = 1e-3;
  const ControlMesh quantized = *QuantizeControlMesh(mesh, step);
  EXPECT_LE((quantized.vertices - mesh.vertices).cwiseAbs().maxCoeff(), step / 2 * (1 + 1e-9));
  EXPECT_EQ(quantized.faces, mesh.faces);
}

TEST(PrepareControlMeshTest, NamesWhatIsWrong) {
  ControlMesh mesh = Octahedron();
  EXPECT_FALSE(QuantizeControlMesh(mesh, 0).ok());
  EXPECT_THAT(QuantizeControlMesh(mesh, 1e-12).status().message(),
              testing::HasSubstr("coordinate 0 of control point 0 is 0.4"));
  mesh.faces(0, 0) = 1;
  EXPECT_EQ(PrepareControlMesh(mesh, 1e-4).status().code(), absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace rilievo
