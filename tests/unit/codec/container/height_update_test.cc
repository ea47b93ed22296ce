// Heights made anew behind a file that stays as it is.
#include "core/codec/container/height_update.h"

#include <algorithm>
#include <cmath>

#include "core/codec/bytes/chunk.h"
#include "core/codec/container/decode_region.h"
#include "core/codec/container/encode_deformed.h"
#include "core/codec/container/encode_update.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr double kUpdateStep = 1e-4;

std::vector<uint8_t> FileToUpdate(const ControlMesh& mesh, int levels, int group_faces) {
  EncodeOptions options;
  options.position_step = 1e-3;
  options.height_step = kUpdateStep;
  options.group_faces = group_faces;
  DssMetadata metadata;
  metadata.generator = "rilievo 1.2.3";
  metadata.error_rms = 1e-4;
  metadata.folds = 3;
  return EncodeDss(SurfaceOver(mesh, levels, options.position_step, 1e-4), metadata, options, {})
      ->Concatenate();
}

// A bump of the height of 0.02 around the limit position of vertex 0; sources of every kind in it.
HeightUpdate BumpOn(const DisplacedSurface& surface) {
  const int level = surface.max_level;
  const LoopRefinement refinement = *RefineTopology(surface.control_mesh, level, {});
  const LimitSurface limit = *EvaluateLimit(refinement, surface.control_mesh.vertices, level, {});
  HeightUpdate update;
  update.step = kUpdateStep;
  update.generator = "rilievo 1.2.4";
  update.heights = surface.heights;
  update.sources = surface.sources;
  for (Eigen::Index v = 0; v < limit.positions.cols(); ++v) {
    const Eigen::Vector3d away = limit.positions.col(v) - limit.positions.col(0);
    const double share = 1 - away.norm() / 0.1;
    update.told.push_back(share > 0 ? 1 : 0);
    if (share <= 0) continue;
    update.heights[v] += static_cast<float>(0.02 * share * share);
    update.sources[v] = away.z() > 0.03   ? HeightSource::kFilled
                        : away.z() > 0.01 ? HeightSource::kSmoothed
                                          : HeightSource::kMeasured;
  }
  return update;
}

std::vector<uint8_t> WithChunk(std::vector<uint8_t> file, const std::vector<uint8_t>& chunk) {
  file.insert(file.end(), chunk.begin(), chunk.end());
  return file;
}

void ExpectTold(const DisplacedSurface& before, const HeightUpdate& update,
                const DisplacedSurface& found) {
  double squared = 0;
  int told = 0;
  for (size_t v = 0; v < update.told.size(); ++v) {
    if (update.told[v] == 0) {
      ASSERT_EQ(found.heights[v], before.heights[v]) << v;
      ASSERT_EQ(found.sources[v], before.sources[v]) << v;
      continue;
    }
    ++told;
    ASSERT_EQ(found.sources[v], update.sources[v]) << v;
    squared += std::pow(found.heights[v] - update.heights[v], 2);
  }
  ASSERT_GT(told, 10);
  EXPECT_LT(std::sqrt(squared / told), 0.6 * kUpdateStep);
}

TEST(HeightUpdateTest, OnlyWhatIsToldChanges) {
  const struct {
    ControlMesh mesh;
    int levels, group_faces;
  } cases[] = {{Torus(12, 8), 3, 0},
               {Torus(24, 12), 3, 128},
               {Sheet(7, 9, true), 3, 0},
               {Torus(12, 8), 0, 0},
               {Torus(24, 12), 1, 128}};
  for (const auto& [mesh, levels, group_faces] : cases) {
    const std::vector<uint8_t> file = FileToUpdate(mesh, levels, group_faces);
    const DecodedSurface before = *DecodeDss(file, {});
    HeightUpdate update = BumpOn(before.surface);
    if (levels == 0) update.told[1] = update.told[2] = update.told[3] = 1;
    const auto chunk = EncodeUpdate(file, before.surface, update, {});
    ASSERT_TRUE(chunk.ok()) << chunk.status();
    const std::vector<uint8_t> updated = WithChunk(file, *chunk);
    const auto after = DecodeDss(updated, {});
    ASSERT_TRUE(after.ok()) << after.status();
    if (levels == 0) {
      EXPECT_NEAR(after->surface.heights[0], update.heights[0], kUpdateStep);
    } else {
      ExpectTold(before.surface, update, after->surface);
    }
    ASSERT_EQ(after->height_changes.size(), update.told.size());
    for (size_t v = 0; v < update.told.size(); ++v) {
      ASSERT_NEAR(after->height_changes[v], after->surface.heights[v] - before.surface.heights[v],
                  1e-7);
    }
    EXPECT_TRUE(before.height_changes.empty());
    EXPECT_EQ(after->metadata.generator, "rilievo 1.2.4");
    EXPECT_EQ(after->metadata.error_rms, -1) << "is the error of another surface";
    EXPECT_EQ(after->metadata.folds, -1);
    const auto filled = std::count(after->surface.sources.begin(), after->surface.sources.end(),
                                   HeightSource::kFilled);
    EXPECT_NEAR(after->metadata.filled_share,
                static_cast<double>(filled) / static_cast<double>(update.told.size()), 1e-3);
  }
}

TEST(HeightUpdateTest, AllHeightsMayBeTold) {
  for (const int group_faces : {0, 128}) {
    const std::vector<uint8_t> file = FileToUpdate(Torus(24, 12), 3, group_faces);
    const DecodedSurface before = *DecodeDss(file, {});
    HeightUpdate update = BumpOn(before.surface);
    for (size_t v = 0; v < update.told.size(); ++v) {
      update.told[v] = 1;
      update.heights[v] += 1e-3F * static_cast<float>(v % 5);
    }
    const auto chunk = EncodeUpdate(file, before.surface, update, {});
    ASSERT_TRUE(chunk.ok()) << chunk.status();
    const auto after = DecodeDss(WithChunk(file, *chunk), {});
    ASSERT_TRUE(after.ok()) << after.status();
    ExpectTold(before.surface, update, after->surface);
  }
}

TEST(HeightUpdateTest, UpdatesFollowEachOther) {
  std::vector<uint8_t> file = FileToUpdate(Torus(12, 8), 3, 0);
  const size_t size = file.size();
  for (int i = 0; i < 3; ++i) {
    const DecodedSurface before = *DecodeDss(file, {});
    const HeightUpdate update = BumpOn(before.surface);
    const std::vector<uint8_t> chunk = *EncodeUpdate(file, before.surface, update, {});
    EXPECT_LT(chunk.size(), size / 3);
    file = WithChunk(std::move(file), chunk);
    const DecodedSurface after = *DecodeDss(file, {});
    ExpectTold(before.surface, update, after.surface);
    for (size_t v = 0; v < update.told.size(); ++v) {
      ASSERT_NEAR(after.height_changes[v], after.surface.heights[v] - before.surface.heights[v],
                  1e-7)
          << "of the last one alone";
    }
  }
  // A prefix is the surface before.
  const auto whole = DecodeDss(std::span(file).first(size), {});
  ASSERT_TRUE(whole.ok()) << whole.status();
  EXPECT_EQ(whole->metadata.error_rms, 1e-4);
}

TEST(HeightUpdateTest, RegionsAreThoseOfTheWhole) {
  const std::vector<uint8_t> file = FileToUpdate(Torus(40, 20), 3, 128);
  const DecodedSurface before = *DecodeDss(file, {});
  const std::vector<uint8_t> updated =
      WithChunk(file, *EncodeUpdate(file, before.surface, BumpOn(before.surface), {}));
  const DisplacedSurface after = DecodeDss(updated, {})->surface;
  std::vector<int> faces;  // around vertex 0
  for (Eigen::Index f = 0; f < after.control_mesh.faces.cols(); ++f) {
    if ((after.control_mesh.faces.col(f).array() < 12).any()) faces.push_back(static_cast<int>(f));
  }
  const auto region = DecodeRegion(updated, faces, kFinestLevel, {});
  ASSERT_TRUE(region.ok()) << region.status();
  EXPECT_LT(region->groups_read, region->groups);
  const TriangleMesh mesh = *Tessellate(after, after.max_level, {});
  const std::vector<int>& vertices = region->region.vertices;
  double moved = 0;
  for (size_t i = 0; i < vertices.size(); ++i) {
    ASSERT_EQ(Eigen::Vector3d(region->region.mesh.vertices.col(static_cast<Eigen::Index>(i))),
              Eigen::Vector3d(mesh.vertices.col(vertices[i])));
    ASSERT_EQ(region->sources[i], after.sources[vertices[i]]);
    moved = std::max(
        moved, double{std::abs(after.heights[vertices[i]] - before.surface.heights[vertices[i]])});
  }
  EXPECT_GT(moved, 0.01);
}

TEST(HeightUpdateTest, AnotherControlMeshTakesThemAlong) {
  const std::vector<uint8_t> file = FileToUpdate(Torus(12, 8), 2, 0);
  const DecodedSurface before = *DecodeDss(file, {});
  const std::vector<uint8_t> updated =
      WithChunk(file, *EncodeUpdate(file, before.surface, BumpOn(before.surface), {}));
  ControlMesh cage = before.surface.control_mesh;
  const SpatialFrame& frame = before.surface.frame;
  cage.vertices = (2 * cage.vertices * frame.diagonal).colwise() + frame.center;
  const auto moved = DecodeDss(*ReplaceControlMesh(updated, cage), {});
  ASSERT_TRUE(moved.ok()) << moved.status();
  EXPECT_EQ(moved->surface.heights, DecodeDss(updated, {})->surface.heights);
}

TEST(HeightUpdateTest, DamageIsSeen) {
  const std::vector<uint8_t> file = FileToUpdate(Torus(12, 8), 2, 0);
  const DecodedSurface before = *DecodeDss(file, {});
  const std::vector<uint8_t> chunk =
      *EncodeUpdate(file, before.surface, BumpOn(before.surface), {});
  const ChunkList list = *ListChunks(WithChunk(file, chunk));
  std::vector<uint8_t> payload(list.chunks.back().payload.begin(),
                               list.chunks.back().payload.end());
  for (size_t size = 0; size < payload.size(); ++size) {
    const std::span<const uint8_t> cut = std::span(payload).first(size);
    EXPECT_EQ(DecodeDss(WithChunk(file, WrapChunk(kUpdateTag, cut, false)), {}).status().code(),
              absl::StatusCode::kDataLoss)
        << size;
  }
  payload[0] |= 64;
  EXPECT_THAT(
      DecodeDss(WithChunk(file, WrapChunk(kUpdateTag, payload, false)), {}).status().message(),
      HasSubstr("unknown flags"));
  // Before the heights it has nothing to add to.
  const std::vector<uint8_t> early = WithChunk(
      {file.begin(), file.begin() + before.chunk_bytes[0] + before.chunk_bytes[1]}, chunk);
  EXPECT_THAT(DecodeDss(early, {}).status().message(), HasSubstr("not all there yet"));
  std::vector<uint8_t> many = file;
  for (size_t i = 0; i <= kMostUpdates; ++i) many = WithChunk(std::move(many), chunk);
  EXPECT_EQ(DecodeDss(many, {}).status().code(), absl::StatusCode::kDataLoss);
  const std::vector<uint8_t> full(many.begin(),
                                  many.end() - static_cast<std::ptrdiff_t>(chunk.size()));
  EXPECT_EQ(EncodeUpdate(full, before.surface, BumpOn(before.surface), {}).status().code(),
            absl::StatusCode::kFailedPrecondition);
}

TEST(HeightUpdateTest, WhatDoesNotFitIsRefused) {
  const std::vector<uint8_t> file = FileToUpdate(Torus(12, 8), 2, 0);
  const DecodedSurface before = *DecodeDss(file, {});
  const HeightUpdate good = BumpOn(before.surface);
  const auto refusal = [&](const HeightUpdate& update, std::span<const uint8_t> dss) {
    return std::string(EncodeUpdate(dss, before.surface, update, {}).status().message());
  };
  HeightUpdate update = good;
  update.told.pop_back();
  EXPECT_THAT(refusal(update, file), HasSubstr("flags"));
  update = good;
  update.heights[0] = 0.7F;
  EXPECT_THAT(refusal(update, file), HasSubstr("height 0 is 0.7"));
  update = good;
  update.step = 0;
  EXPECT_THAT(refusal(update, file), HasSubstr("step is 0"));
  const std::span<const uint8_t> prefix =
      std::span(file).first(static_cast<size_t>(before.chunk_bytes[0] + before.chunk_bytes[1]));
  EXPECT_THAT(refusal(good, prefix), HasSubstr("ends at level"));
}

}  // namespace
}  // namespace rilievo
