// Hostile bytes where heights stand in groups: whole decoding and DecodeRegion alike give a named
// error or a surface that is one, and agree where both give one.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "core/codec/container/decode_region.h"
#include "core/codec/container/dss.h"
#include "core/codec/mesh/face_groups.h"
#include "core/geometry/mesh_topology.h"
#include "tests/fuzz/right_checksums.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

constexpr int kFaces = 2 * 20 * 10 + 2 * 6 * 6 - 2;

// A torus beside a sheet with a hole: four groups of at most 128 faces, heights of every kind.
EncodedSurface EncodedInGroups(int max_level) {
  EncodeOptions options;
  options.group_faces = kLeastGroupLimit;
  options.height_step = 5e-4;
  const ControlMesh mesh = Together(Torus(20, 10), Sheet(7, 7, true), {0.02, 0.05, 0.01});
  return *EncodeDss(SurfaceOver(mesh, max_level, kPositionStep, 5e-4), {}, options, RunContext());
}

RunContext OneThread() {
  RunContext context;
  context.threads = 1;
  return context;
}

void ExpectSound(const DecodedSurface& decoded) {
  const DisplacedSurface& surface = decoded.surface;
  EXPECT_TRUE(BuildMeshTopology(surface.control_mesh.faces,
                                static_cast<int>(surface.control_mesh.vertices.cols()))
                  .ok());
  EXPECT_EQ(surface.heights.size(), surface.sources.size());
  EXPECT_TRUE(Tessellate(surface, surface.max_level, OneThread()).ok());
}

void ExpectSound(const DecodedRegion& part) {
  const RegionMesh& region = part.region;
  EXPECT_EQ(region.vertices.size(), part.sources.size());
  EXPECT_EQ(static_cast<Eigen::Index>(region.vertices.size()), region.mesh.vertices.cols());
  EXPECT_TRUE(region.mesh.vertices.allFinite());
  EXPECT_TRUE(region.mesh.normals.allFinite());
  EXPECT_GE(region.mesh.triangles.minCoeff(), 0);
  EXPECT_LT(region.mesh.triangles.maxCoeff(), region.mesh.vertices.cols());
}

bool IsClean(const absl::Status& status) {
  return status.code() == absl::StatusCode::kDataLoss ||
         status.code() == absl::StatusCode::kInvalidArgument ||
         status.code() == absl::StatusCode::kUnimplemented;
}

struct Outcome {
  bool whole = false, part = false;
};

// Exactly as many bytes as there are, so that a sanitizer sees a read past the end.
Outcome Decode(std::span<const uint8_t> bytes, bool thorough) {
  const std::vector<uint8_t> exact(bytes.begin(), bytes.end());
  const auto whole = DecodeDss(exact, OneThread());
  const std::vector<int> faces = {0, 1, kFaces - 1};
  const auto part = DecodeRegion(exact, faces, kFinestLevel, OneThread());
  EXPECT_TRUE(whole.ok() || IsClean(whole.status())) << whole.status();
  EXPECT_TRUE(part.ok() || IsClean(part.status())) << part.status();
  // A region asks for less of the bytes than the whole does.
  EXPECT_TRUE(part.ok() || !whole.ok() || whole->surface.control_mesh.faces.cols() != kFaces)
      << part.status();
  if (thorough && whole.ok()) ExpectSound(*whole);
  if (thorough && part.ok()) ExpectSound(*part);
  if (thorough && whole.ok() && part.ok()) {
    const auto mesh = Tessellate(whole->surface, part->level, OneThread());
    EXPECT_TRUE(mesh.ok());
    for (size_t v = 0; v < part->region.vertices.size(); ++v) {
      const int there = part->region.vertices[v];
      EXPECT_EQ(part->sources[v], whole->surface.sources[there]);
      EXPECT_EQ(part->region.mesh.vertices.col(static_cast<Eigen::Index>(v)),
                mesh->vertices.col(there));
    }
  }
  return {whole.ok(), part.ok()};
}

std::vector<size_t> EndsOfChunks(const EncodedSurface& encoded) {
  std::vector<size_t> ends;
  for (const auto& chunk : encoded.chunks) {
    ends.push_back((ends.empty() ? 0 : ends.back()) + chunk.size());
  }
  return ends;
}

TEST(GroupedDssTest, PrefixesOfWholeChunksDecodeAndNoOthers) {
  const EncodedSurface encoded = EncodedInGroups(3);
  const std::vector<uint8_t> all = encoded.Concatenate();
  ASSERT_EQ(DecodeDss(all, RunContext())->surface.control_mesh.faces.cols(), kFaces);
  const std::vector<int> face = {0};
  ASSERT_EQ(DecodeRegion(all, face, kFinestLevel, RunContext())->groups, 4);
  const std::vector<size_t> ends = EndsOfChunks(encoded);
  for (size_t size = 0; size <= all.size(); ++size) {
    const bool whole = std::find(ends.begin(), ends.end(), size) != ends.end();
    const Outcome outcome = Decode(std::span(all).first(size), whole);
    ASSERT_EQ(outcome.whole, whole) << size;
    ASSERT_EQ(outcome.part, whole) << size;
  }
}

// A region does not look at the checksums of pieces that it does not need.
TEST(GroupedDssTest, EveryChangedByteIsNoticedWhereItMatters) {
  const std::vector<uint8_t> all = EncodedInGroups(2).Concatenate();
  const std::vector<int> faces = {0, 1, kFaces - 1};
  const auto right = DecodeRegion(all, faces, kFinestLevel, OneThread());
  ASSERT_TRUE(right.ok()) << right.status();
  int unseen = 0;
  for (size_t at = 0; at < all.size(); ++at) {
    std::vector<uint8_t> changed = all;
    changed[at] ^= static_cast<uint8_t>(1 << (at % 8));
    EXPECT_FALSE(DecodeDss(changed, OneThread()).ok()) << at;
    const auto part = DecodeRegion(changed, faces, kFinestLevel, OneThread());
    if (!part.ok()) {
      EXPECT_TRUE(IsClean(part.status())) << part.status();
      continue;
    }
    ++unseen;
    EXPECT_EQ(part->region.mesh.vertices, right->region.mesh.vertices) << at;
    EXPECT_EQ(part->sources, right->sources) << at;
  }
  EXPECT_LT(unseen, static_cast<int>(all.size() / 2));
}

TEST(GroupedDssTest, MadeUpBytesAreRefusedOrValid) {
  const std::vector<uint8_t> all = EncodedInGroups(3).Concatenate();
  const std::vector<size_t> ends = EndsOfChunks(EncodedInGroups(3));
  int accepted = 0, refused = 0;
  for (uint64_t round = 0; round < 600; ++round) {
    std::vector<uint8_t> changed = all;
    const int changes = 1 + static_cast<int>(MixedBits(10 * round) % 4);
    for (int i = 0; i < changes; ++i) {
      // Two thirds in the chunks of groups.
      const size_t begin = round % 3 == 0 ? 9 : ends[2];
      const uint64_t at = begin + MixedBits(10 * round + 1 + 2 * i) % (all.size() - begin);
      changed[at] = static_cast<uint8_t>(MixedBits(10 * round + 2 + 2 * i));
    }
    const bool thorough = round % 8 == 0;
    (Decode(WithRightChecksums(changed), thorough).whole ? accepted : refused) += 1;
  }
  EXPECT_GT(accepted, 100);
  EXPECT_GT(refused, 100);
}

// Runs of bytes copied elsewhere, left out, or put in twice.
TEST(GroupedDssTest, SplicedBytesAreRefusedOrValid) {
  const std::vector<uint8_t> all = EncodedInGroups(3).Concatenate();
  int accepted = 0, refused = 0;
  for (uint64_t round = 0; round < 1200; ++round) {
    const auto bits = [&](uint64_t k, size_t below) {
      return static_cast<std::ptrdiff_t>(MixedBits(8 * round + k) % below);
    };
    std::vector<uint8_t> changed = all;
    const std::ptrdiff_t length = 1 + bits(1, 64), from = bits(2, all.size() - 64),
                         to = 9 + bits(3, all.size() - 9 - 64);
    const std::vector<uint8_t> run(all.begin() + from, all.begin() + from + length);
    if (round % 3 == 0) std::copy(run.begin(), run.end(), changed.begin() + to);
    if (round % 3 == 1) changed.erase(changed.begin() + to, changed.begin() + to + length);
    if (round % 3 == 2) changed.insert(changed.begin() + to, run.begin(), run.end());
    const auto fixed = round % 4 == 0 ? changed : WithRightChecksums(changed);
    (Decode(fixed, round % 8 == 0).whole ? accepted : refused) += 1;
  }
  EXPECT_GT(accepted, 50);
  EXPECT_GT(refused, 500);
}

TEST(GroupedDssTest, ThreadsDoNotChangeTheHeights) {
  const std::vector<uint8_t> all = EncodedInGroups(3).Concatenate();
  RunContext four;
  four.threads = 4;
  EXPECT_EQ(DecodeDss(all, four)->surface.heights, DecodeDss(all, OneThread())->surface.heights);
}

}  // namespace
}  // namespace rilievo
