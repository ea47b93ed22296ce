// Objects of the C interface for its tests: owned, and as vectors.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"

namespace rilievo {

struct FreeObject {
  void operator()(RilievoSurface* surface) const { rilievo_surface_free(surface); }
  void operator()(RilievoMesh* mesh) const { rilievo_mesh_free(mesh); }
  void operator()(RilievoEvaluator* evaluator) const { rilievo_evaluator_free(evaluator); }
  void operator()(RilievoFinder* finder) const { rilievo_finder_free(finder); }
  void operator()(RilievoVoxels* voxels) const { rilievo_voxels_free(voxels); }
};
template <typename Object>
using Owned = std::unique_ptr<Object, FreeObject>;
using SurfacePtr = Owned<RilievoSurface>;
using MeshPtr = Owned<RilievoMesh>;

inline std::vector<uint8_t> Golden(const std::string& name) {
  std::ifstream in(RILIEVO_GOLDEN_FOLDER "/" + name, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

inline SurfacePtr Decode(std::span<const uint8_t> bytes) {
  RilievoSurface* surface = nullptr;
  EXPECT_EQ(rilievo_decode(bytes.data(), bytes.size(), 0, &surface), RILIEVO_OK)
      << rilievo_last_error();
  return SurfacePtr(surface);
}

inline MeshPtr Tessellated(const RilievoSurface* surface, int level) {
  RilievoMesh* mesh = nullptr;
  EXPECT_EQ(rilievo_tessellate(surface, level, 1, &mesh), RILIEVO_OK) << rilievo_last_error();
  return MeshPtr(mesh);
}

// All that a getter of the interface points at.
template <typename T, typename Object>
std::vector<T> All(const T* (*get)(const Object*, size_t*), const Object* object) {
  size_t count = 0;
  const T* data = get(object, &count);
  EXPECT_EQ(get(object, nullptr), data);
  return {data, data + count};
}

}  // namespace rilievo
