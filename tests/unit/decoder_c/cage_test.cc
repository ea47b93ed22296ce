// Another cage by the C interface.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"

namespace rilievo {
namespace {

struct FreeCageTest {
  void operator()(RilievoSurface* surface) const { rilievo_surface_free(surface); }
  void operator()(RilievoMesh* mesh) const { rilievo_mesh_free(mesh); }
};
using CagedSurface = std::unique_ptr<RilievoSurface, FreeCageTest>;

CagedSurface Torus() {
  std::ifstream in(RILIEVO_GOLDEN_FOLDER "/colored_torus_in_groups_v3.dss", std::ios::binary);
  const std::vector<uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
  RilievoSurface* decoded = nullptr;
  EXPECT_EQ(rilievo_decode(bytes.data(), bytes.size(), 0, &decoded), RILIEVO_OK);
  return CagedSurface(decoded);
}

template <typename T, typename Object>
std::vector<T> Values(const T* (*get)(const Object*, size_t*), const Object* object) {
  size_t count = 0;
  const T* data = get(object, &count);
  return {data, data + count};
}

// Vertices and colours of level 2.
struct SeenMesh {
  std::vector<double> vertices;
  std::vector<uint8_t> colors;
};
SeenMesh MeshOf(const RilievoSurface* surface) {
  RilievoMesh* mesh = nullptr;
  EXPECT_EQ(rilievo_tessellate(surface, 2, 1, &mesh), RILIEVO_OK) << rilievo_last_error();
  const std::unique_ptr<RilievoMesh, FreeCageTest> freed(mesh);
  const RilievoMesh* seen = mesh;
  return {Values(rilievo_mesh_vertices, seen), Values(rilievo_mesh_colors, seen)};
}

const RilievoSurface* Read(const CagedSurface& surface) { return surface.get(); }

CagedSurface WithCage(const RilievoSurface* surface, std::span<const double> vertices) {
  RilievoSurface* moved = nullptr;
  EXPECT_EQ(rilievo_surface_with_cage(surface, vertices.data(), vertices.size() / 3, nullptr,
                                      nullptr, 0, nullptr, 0, &moved),
            RILIEVO_OK)
      << rilievo_last_error();
  return CagedSurface(moved);
}

TEST(CCageTest, AnotherCageMovesTheSurface) {
  CagedSurface surface = Torus();
  std::vector<double> cage = Values(rilievo_control_vertices, Read(surface));
  for (size_t i = 2; i < cage.size(); i += 3) cage[i] += 7;
  const SeenMesh before = MeshOf(surface.get());
  const CagedSurface moved = WithCage(surface.get(), cage);
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
  const CagedSurface surface = Torus();
  const std::vector<double> cage = Values(rilievo_control_vertices, Read(surface));
  const std::vector<uint32_t> faces = Values(rilievo_control_faces, Read(surface));
  const uint32_t edge[] = {std::max(faces[0], faces[1]), std::min(faces[0], faces[1])};
  const float sharpness = 2.5f;
  const auto tag = [&](const RilievoSurface* of, size_t creases, size_t corners) {
    RilievoSurface* tagged = nullptr;
    EXPECT_EQ(rilievo_surface_with_cage(of, cage.data(), cage.size() / 3, edge, &sharpness, creases,
                                        edge, corners, &tagged),
              RILIEVO_OK)
        << rilievo_last_error();
    return CagedSurface(tagged);
  };
  const CagedSurface tagged = tag(surface.get(), 1, 1);
  EXPECT_EQ(Values(rilievo_control_creases, Read(tagged)),
            (std::vector<uint32_t>{edge[1], edge[0]}));
  EXPECT_EQ(Values(rilievo_control_corners, Read(tagged)), std::vector<uint32_t>{edge[0]});
  const CagedSurface kept = WithCage(tagged.get(), cage);
  EXPECT_EQ(Values(rilievo_control_sharpness, Read(kept)), std::vector<float>{sharpness});
  EXPECT_TRUE(Values(rilievo_control_creases, Read(tag(tagged.get(), 0, 0))).empty());

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
