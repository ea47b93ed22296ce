// Solids combined and trimmed by the C interface.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"
#include "tests/unit/decoder_c/c_objects.h"

namespace rilievo {
namespace {

using testing::HasSubstr;

MeshPtr BoxOf(double low, double high) {
  std::vector<double> vertices;
  for (int v = 0; v < 8; ++v) {
    for (int axis = 0; axis < 3; ++axis) vertices.push_back((v >> axis & 1) != 0 ? high : low);
  }
  const std::vector<uint32_t> faces = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                       2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  RilievoMesh* mesh = nullptr;
  EXPECT_EQ(rilievo_mesh_create(vertices.data(), 8, faces.data(), 12, 1, &mesh), RILIEVO_OK)
      << rilievo_last_error();
  return MeshPtr(mesh);
}

double VolumeOf(const RilievoMesh* mesh) {
  const auto vertices = All(rilievo_mesh_vertices, mesh);
  const auto faces = All(rilievo_mesh_faces, mesh);
  double volume = 0;
  for (size_t f = 0; f < faces.size(); f += 3) {
    Eigen::Matrix3d corners;
    for (int k = 0; k < 3; ++k) {
      corners.col(k) = Eigen::Map<const Eigen::Vector3d>(&vertices[3 * faces[f + k]]);
    }
    volume += corners.determinant() / 6;
  }
  return volume;
}

TEST(CSolidsTest, SolidsAreCombined) {
  const MeshPtr a = BoxOf(0, 2), b = BoxOf(1, 3);
  const double volumes[] = {15, 1, 7};
  for (const int operation : {RILIEVO_UNION, RILIEVO_INTERSECTION, RILIEVO_DIFFERENCE}) {
    RilievoMesh* mesh = nullptr;
    ASSERT_EQ(rilievo_combine(a.get(), b.get(), operation, 1, &mesh), RILIEVO_OK);
    const MeshPtr combined(mesh);
    EXPECT_NEAR(VolumeOf(mesh), volumes[operation], 1e-9);
    EXPECT_TRUE(All(rilievo_mesh_normals, static_cast<const RilievoMesh*>(mesh)).empty());
  }
}

TEST(CSolidsTest, WhatIsNoSolidIsNotCombined) {
  const MeshPtr box = BoxOf(0, 1), far = BoxOf(5, 6);
  const SurfacePtr open = Decode(Golden("sheet_and_octahedron_v2.dss"));
  const MeshPtr sheet = Tessellated(open.get(), 1);
  RilievoMesh* mesh = nullptr;
  EXPECT_EQ(rilievo_combine(box.get(), sheet.get(), RILIEVO_UNION, 1, &mesh),
            RILIEVO_FAILED_PRECONDITION);
  EXPECT_THAT(rilievo_last_error(), HasSubstr("the second shape is open"));
  EXPECT_EQ(rilievo_combine(box.get(), far.get(), RILIEVO_INTERSECTION, 1, &mesh),
            RILIEVO_FAILED_PRECONDITION);
  EXPECT_THAT(rilievo_last_error(), HasSubstr("nothing is left"));
  EXPECT_EQ(rilievo_combine(box.get(), far.get(), 3, 1, &mesh), RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_combine(box.get(), nullptr, 0, 1, &mesh), RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_combine(box.get(), far.get(), 0, 1, nullptr), RILIEVO_INVALID_ARGUMENT);
  const double vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  for (const uint32_t last : {3u, 4'000'000'000u}) {
    const uint32_t faces[] = {0, 1, last};
    EXPECT_EQ(rilievo_mesh_create(vertices, 3, faces, 1, 1, &mesh), RILIEVO_INVALID_ARGUMENT);
    EXPECT_THAT(rilievo_last_error(), HasSubstr("there are the vertices 0 to 2"));
  }
  EXPECT_EQ(rilievo_mesh_create(nullptr, 3, nullptr, 0, 1, &mesh), RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(mesh, nullptr);
}

TEST(CSolidsTest, MeshesAreTrimmed) {
  const MeshPtr box = BoxOf(0, 2);
  const std::vector<double> shapes[] = {{0, 0, 3, 3},
                                        {-1, -1, -1, 1, 1, 1},
                                        {0, 0, 0, 0.1},
                                        {0, 0, 1, 1, -1, 0, 3, -1, 0, 3, 3, 0, 1, 3, 0}};
  const double inside[] = {4, 1, std::numbers::pi / 6000, 4};
  for (int shape = RILIEVO_PLANE; shape <= RILIEVO_PRISM; ++shape) {
    const auto& numbers = shapes[shape];
    for (const int outside : {0, 1}) {
      RilievoMesh* mesh = nullptr;
      ASSERT_EQ(
          rilievo_trim(box.get(), shape, numbers.data(), numbers.size(), outside, 1, 1, &mesh),
          RILIEVO_OK)
          << rilievo_last_error();
      const MeshPtr closed(mesh);
      EXPECT_NEAR(VolumeOf(mesh), outside != 0 ? 8 - inside[shape] : inside[shape], 1e-5);
      ASSERT_EQ(
          rilievo_trim(box.get(), shape, numbers.data(), numbers.size(), outside, 0, 1, &mesh),
          RILIEVO_OK);
      const MeshPtr open(mesh);
      // The sides through the origin add nothing to the sum, and the shape's are not there.
      EXPECT_GT(std::abs(VolumeOf(mesh) - VolumeOf(closed.get())), 1e-4);
    }
    RilievoMesh* none = nullptr;
    EXPECT_EQ(rilievo_trim(box.get(), shape, numbers.data(), 2, 0, 0, 1, &none),
              RILIEVO_INVALID_ARGUMENT);
    EXPECT_THAT(rilievo_last_error(), HasSubstr("of 2 numbers"));
  }
  const double below[] = {0, 0, 1, -1};
  RilievoMesh* none = nullptr;
  EXPECT_EQ(rilievo_trim(box.get(), RILIEVO_PLANE, below, 4, 0, 0, 1, &none),
            RILIEVO_FAILED_PRECONDITION);
  EXPECT_EQ(rilievo_trim(nullptr, RILIEVO_PLANE, below, 4, 0, 0, 1, &none),
            RILIEVO_INVALID_ARGUMENT);
}

}  // namespace
}  // namespace rilievo
