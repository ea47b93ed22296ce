// Another cage by the C interface.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"
#include "tests/unit/decoder_c/c_objects.h"

namespace rilievo {
namespace {

SurfacePtr Torus() { return Decode(Golden("colored_torus_in_groups_v3.dss")); }

// Vertices and colours of level 2.
struct SeenMesh {
  std::vector<double> vertices;
  std::vector<uint8_t> colors;
};
SeenMesh MeshOf(const RilievoSurface* surface) {
  const MeshPtr owned = Tessellated(surface, 2);
  const RilievoMesh* mesh = owned.get();
  return {All(rilievo_mesh_vertices, mesh), All(rilievo_mesh_colors, mesh)};
}

const RilievoSurface* Read(const SurfacePtr& surface) { return surface.get(); }

SurfacePtr WithCage(const RilievoSurface* surface, std::span<const double> vertices) {
  RilievoSurface* moved = nullptr;
  EXPECT_EQ(rilievo_surface_with_cage(surface, vertices.data(), vertices.size() / 3, nullptr,
                                      nullptr, 0, nullptr, 0, &moved),
            RILIEVO_OK)
      << rilievo_last_error();
  return SurfacePtr(moved);
}

TEST(CCageTest, AnotherCageMovesTheSurface) {
  SurfacePtr surface = Torus();
  std::vector<double> cage = All(rilievo_control_vertices, Read(surface));
  for (size_t i = 2; i < cage.size(); i += 3) cage[i] += 7;
  const SeenMesh before = MeshOf(surface.get());
  const SurfacePtr moved = WithCage(surface.get(), cage);
  surface.reset();
  const SeenMesh after = MeshOf(moved.get());
  std::vector<double> expected = before.vertices;
  for (size_t i = 2; i < expected.size(); i += 3) expected[i] += 7;
  EXPECT_THAT(after.vertices, testing::Pointwise(testing::DoubleNear(1e-9), expected));
  EXPECT_EQ(after.colors, before.colors);
  size_t size = 0;
  const nlohmann::json info = nlohmann::json::parse(rilievo_surface_info(moved.get(), &size));
  EXPECT_TRUE(info["certificate"]["folds"].is_null());
  EXPECT_TRUE(info["chunk_bytes"].empty());
}

TEST(CCageTest, TagsOfACageAreTakenOrKept) {
  const SurfacePtr surface = Torus();
  const std::vector<double> cage = All(rilievo_control_vertices, Read(surface));
  const std::vector<uint32_t> faces = All(rilievo_control_faces, Read(surface));
  const uint32_t edge[] = {std::max(faces[0], faces[1]), std::min(faces[0], faces[1])};
  const float sharpness = 2.5f;
  const auto tag = [&](const RilievoSurface* of, size_t creases, size_t corners) {
    RilievoSurface* tagged = nullptr;
    EXPECT_EQ(rilievo_surface_with_cage(of, cage.data(), cage.size() / 3, edge, &sharpness, creases,
                                        edge, corners, &tagged),
              RILIEVO_OK)
        << rilievo_last_error();
    return SurfacePtr(tagged);
  };
  const SurfacePtr tagged = tag(surface.get(), 1, 1);
  EXPECT_EQ(All(rilievo_control_creases, Read(tagged)), (std::vector<uint32_t>{edge[1], edge[0]}));
  EXPECT_EQ(All(rilievo_control_corners, Read(tagged)), std::vector<uint32_t>{edge[0]});
  const SurfacePtr kept = WithCage(tagged.get(), cage);
  EXPECT_EQ(All(rilievo_control_sharpness, Read(kept)), std::vector<float>{sharpness});
  EXPECT_TRUE(All(rilievo_control_creases, Read(tag(tagged.get(), 0, 0))).empty());

  RilievoSurface* moved = nullptr;
  const auto refused = [&](size_t vertices, size_t creases, size_t corners) {
    return rilievo_surface_with_cage(surface.get(), cage.data(), vertices, faces.data(), &sharpness,
                                     creases, edge, corners, &moved) == RILIEVO_INVALID_ARGUMENT;
  };
  EXPECT_TRUE(refused(cage.size() / 3 - 1, 0, 0));
  EXPECT_TRUE(refused(~size_t{0} / 8, 0, 0));
  EXPECT_TRUE(refused(cage.size() / 3, ~size_t{0} / 8, 0));
  EXPECT_EQ(
      rilievo_surface_with_cage(surface.get(), nullptr, 3, nullptr, nullptr, 0, nullptr, 0, &moved),
      RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(rilievo_surface_with_cage(surface.get(), cage.data(), cage.size() / 3, nullptr, nullptr,
                                      0, nullptr, 0, nullptr),
            RILIEVO_INVALID_ARGUMENT);
  EXPECT_EQ(moved, nullptr);
}

}  // namespace
}  // namespace rilievo
