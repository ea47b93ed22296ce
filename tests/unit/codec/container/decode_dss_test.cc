// What a decoder does with bytes that are cut, changed or made up: a named error or a surface that
// is one, within the memory that the law allows.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/codec/bytes/chunk.h"
#include "core/codec/bytes/crc32c.h"
#include "core/codec/container/dss.h"
#include "core/codec/container/dss_header.h"
#include "core/geometry/mesh_topology.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"
#include "tests/unit/codec/test_surfaces.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr uint8_t kEmptyLayer = 128;  // first byte of a layer without coefficients

EncodedSurface EncodedSheet(int max_level) {
  DssMetadata metadata;
  metadata.generator = "codec test";
  return *EncodeDss(SurfaceOver(Sheet(6, 7, true), max_level, kPositionStep, 1e-4), metadata, {},
                    RunContext());
}

// Every surface that comes out of a decoder can be tessellated: sizes and indices fit.
void ExpectValid(const DecodedSurface& decoded) {
  const DisplacedSurface& surface = decoded.surface;
  EXPECT_TRUE(BuildMeshTopology(surface.control_mesh.faces,
                                static_cast<int>(surface.control_mesh.vertices.cols()))
                  .ok());
  EXPECT_TRUE(surface.control_mesh.vertices.allFinite());
  EXPECT_EQ(surface.heights.size(), surface.sources.size());
  for (HeightSource source : surface.sources) EXPECT_LE(source, HeightSource::kFilled);
  EXPECT_TRUE(Tessellate(surface, surface.max_level, RunContext()).ok());
}

// Exactly as many bytes as there are, so that a sanitizer sees a read past the end.
absl::StatusOr<DecodedSurface> DecodeExact(std::span<const uint8_t> bytes) {
  const std::vector<uint8_t> exact(bytes.begin(), bytes.end());
  return DecodeDss(std::span(exact.data(), exact.size()), RunContext());
}

TEST(DecodeDssTest, EveryPrefixOfWholeChunksIsASurface) {
  const EncodedSurface encoded = EncodedSheet(3);
  const std::vector<uint8_t> all = encoded.Concatenate();
  const auto whole = DecodeExact(all);
  ASSERT_TRUE(whole.ok()) << whole.status();
  size_t end = 0;
  for (size_t chunks = 1; chunks <= encoded.chunks.size(); ++chunks) {
    end += encoded.chunks[chunks - 1].size();
    const auto decoded = DecodeExact(std::span(all).first(end));
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    ExpectValid(*decoded);
    EXPECT_EQ(decoded->declared_max_level, 3);
    EXPECT_EQ(decoded->surface.control_mesh.vertices, whole->surface.control_mesh.vertices);
    if (chunks == 1) {
      EXPECT_EQ(decoded->surface.max_level, 0);
      for (HeightSource source : decoded->surface.sources) EXPECT_EQ(source, HeightSource::kFilled);
      continue;
    }
    // The last chunk tells which heights are smoothed.
    EXPECT_EQ(decoded->surface.max_level, std::min(3, static_cast<int>(chunks) - 2));
    EXPECT_EQ(std::count(decoded->surface.sources.begin(), decoded->surface.sources.end(),
                         HeightSource::kSmoothed) > 0,
              chunks == 6);
    // Averages of what finer levels hold: near the heights of the whole.
    for (size_t v = 0; v < decoded->surface.heights.size(); ++v) {
      EXPECT_NEAR(decoded->surface.heights[v], whole->surface.heights[v], 2e-3);
    }
    if (chunks >= 5) {
      EXPECT_EQ(decoded->surface.heights, whole->surface.heights);
    }
  }
}

// Whatever comes first helps most.
TEST(DecodeDssTest, EveryLayerLowersTheError) {
  const DisplacedSurface surface = SurfaceOver(Torus(10, 6), 4, kPositionStep, 0);
  const std::vector<float>& heights = surface.heights;
  EncodedSurface encoded = *EncodeDss(surface, {}, {}, RunContext());
  encoded.chunks.resize(6);  // the last one tells which heights are smoothed
  std::vector<uint8_t> bytes;
  double last = std::numeric_limits<double>::infinity();
  for (const auto& chunk : encoded.chunks) {
    bytes.insert(bytes.end(), chunk.begin(), chunk.end());
    const auto decoded = DecodeExact(bytes);
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    // The part's heights, and the limit surface where it ends.
    std::vector<float> part = decoded->surface.heights;
    part.resize(heights.size(), 0);
    double error = 0;
    for (size_t v = 0; v < heights.size(); ++v) {
      if (surface.sources[v] != HeightSource::kFilled) error += std::pow(part[v] - heights[v], 2);
    }
    EXPECT_LT(error, last);
    last = error;
  }
}

TEST(DecodeDssTest, EveryOtherPrefixIsRefused) {
  const EncodedSurface encoded = EncodedSheet(2);
  const std::vector<uint8_t> all = encoded.Concatenate();
  std::vector<size_t> ends = {0};
  for (const auto& chunk : encoded.chunks) ends.push_back(ends.back() + chunk.size());
  for (size_t size = 0; size < all.size(); ++size) {
    const auto decoded = DecodeExact(std::span(all).first(size));
    const bool whole = size > 0 && std::find(ends.begin(), ends.end(), size) != ends.end();
    ASSERT_EQ(decoded.ok(), whole) << size;
    if (whole) continue;
    EXPECT_EQ(decoded.status().code(),
              size == 0 ? absl::StatusCode::kInvalidArgument : absl::StatusCode::kDataLoss)
        << size << ": " << decoded.status();
  }
  EXPECT_THAT(DecodeExact(std::span(all).first(ends[2] + 5)).status().message(),
              HasSubstr("chunk 2"));
}

TEST(DecodeDssTest, EveryChangedByteIsNoticed) {
  const std::vector<uint8_t> all = EncodedSheet(1).Concatenate();
  for (size_t at = 0; at < all.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::vector<uint8_t> changed = all;
      changed[at] ^= static_cast<uint8_t>(1 << bit);
      EXPECT_FALSE(DecodeExact(changed).ok()) << at;
    }
  }
}

TEST(DecodeDssTest, TheControlChunkDecodesWhateverFollows) {
  std::vector<uint8_t> bytes = EncodedSheet(1).Concatenate();
  bytes.back() ^= 1;
  EXPECT_FALSE(DecodeDss(bytes, RunContext()).ok());
  const auto control = DecodeControlChunk(bytes, RunContext());
  ASSERT_TRUE(control.ok()) << control.status();
  EXPECT_EQ(control->chunk_bytes.size(), 1u);
  EXPECT_EQ(control->surface.max_level, 0);
  EXPECT_EQ(control->declared_max_level, 1);
}

TEST(DecodeDssTest, TellsForeignAndNewerBytesApart) {
  std::vector<uint8_t> bytes = EncodedSheet(1).Concatenate();
  std::vector<uint8_t> foreign = bytes;
  foreign[1] = 'X';
  EXPECT_EQ(DecodeExact(foreign).status().code(), absl::StatusCode::kInvalidArgument);
  std::vector<uint8_t> newer = bytes;
  newer[8] = 7;
  EXPECT_EQ(DecodeExact(newer).status().code(), absl::StatusCode::kUnimplemented);
  EXPECT_THAT(DecodeExact(newer).status().message(), HasSubstr("version 7"));
  bytes.push_back(0);
  EXPECT_EQ(DecodeExact(bytes).status().code(), absl::StatusCode::kDataLoss);
}

// Where a chunk lies, found without the reader under test.
struct Span {
  size_t begin, payload, checksum;
};

std::vector<Span> FindChunks(const EncodedSurface& encoded) {
  std::vector<Span> spans;
  size_t begin = 0;
  for (size_t i = 0; i < encoded.chunks.size(); ++i) {
    size_t at = begin + (i == 0 ? 9 : 0) + 1;
    const std::vector<uint8_t> all = encoded.Concatenate();
    while ((all[at] & 0x80) != 0) ++at;
    spans.push_back({begin, at + 1, begin + encoded.chunks[i].size() - 4});
    begin += encoded.chunks[i].size();
  }
  return spans;
}

void FixChecksum(const Span& span, std::vector<uint8_t>& bytes) {
  const uint32_t crc = Crc32c(std::span(bytes).subspan(span.begin, span.checksum - span.begin));
  for (int i = 0; i < 4; ++i) bytes[span.checksum + i] = static_cast<uint8_t>(crc >> (8 * i));
}

// Changes that a checksum would catch, with the checksum made good: what a malicious writer can do.
TEST(DecodeDssTest, MadeUpPayloadsAreRefusedOrValid) {
  int refused = 0, accepted = 0;
  for (int max_level : {0, 2}) {
    const EncodedSurface encoded = EncodedSheet(max_level);
    const std::vector<uint8_t> all = encoded.Concatenate();
    const std::vector<Span> spans = FindChunks(encoded);
    for (uint64_t round = 0; round < 4000; ++round) {
      const Span& span = spans[MixedBits(10 * round) % spans.size()];
      std::vector<uint8_t> changed = all;
      const int changes = 1 + static_cast<int>(MixedBits(10 * round + 1) % 4);
      for (int i = 0; i < changes; ++i) {
        const uint64_t at = MixedBits(10 * round + 2 + 2 * i) % (span.checksum - span.payload);
        changed[span.payload + at] = static_cast<uint8_t>(MixedBits(10 * round + 3 + 2 * i));
      }
      FixChecksum(span, changed);
      const auto decoded = DecodeExact(changed);
      if (decoded.ok()) {
        ++accepted;
        if (accepted % 16 == 0) ExpectValid(*decoded);
      } else {
        ++refused;
        EXPECT_EQ(decoded.status().code(), absl::StatusCode::kDataLoss) << decoded.status();
      }
    }
  }
  // Most changes to coded heights give other heights; most to the control mesh break it.
  EXPECT_GT(accepted, 500);
  EXPECT_GT(refused, 500);
}

std::vector<uint8_t> WithHeader(const EncodedSurface& encoded, size_t offset, uint8_t value) {
  std::vector<uint8_t> bytes = encoded.chunks[0];
  const Span span = FindChunks(encoded)[0];
  bytes[span.payload + offset] = value;
  FixChecksum(span, bytes);
  return bytes;
}

// The first chunk, said to be followed by other levels.
std::vector<uint8_t> WithMaxLevel(const EncodedSurface& encoded, uint8_t max_level) {
  return WithHeader(encoded, 4, max_level);
}

TEST(DecodeDssTest, CountsBeyondTheBytesAreRefused) {
  const EncodedSurface encoded = EncodedSheet(1);
  // Payload: length of the header, flags, vertices, faces, max_level, each one byte here.
  const std::vector<uint8_t>& chunk = encoded.chunks[0];
  const size_t payload = FindChunks(encoded)[0].payload;
  ASSERT_EQ(chunk[payload + 2], 42);
  ASSERT_EQ(chunk[payload + 3], 58);
  for (int vertices = 0; vertices < 128; ++vertices) {
    const auto decoded = DecodeExact(WithHeader(encoded, 2, static_cast<uint8_t>(vertices)));
    EXPECT_EQ(decoded.ok(), vertices == 42) << vertices;
  }
  EXPECT_THAT(DecodeExact(WithHeader(encoded, 4, 9)).status().message(),
              HasSubstr("max_level is 9"));
}

// The largest counts of the format in a chunk of a few bytes must not cost memory or time.
TEST(DecodeDssTest, HugeCountsInFewBytesAreRefused) {
  DssHeader header;
  header.vertex_count = 1 << 28;
  header.face_count = 1 << 28;
  header.position_step = header.height_unit = 1e-6;
  const auto refusal = [](const DssHeader& with) {
    const std::vector<uint8_t> head = EncodeDssHeader(with);
    std::vector<uint8_t> payload = {static_cast<uint8_t>(head.size())};
    payload.insert(payload.end(), head.begin(), head.end());
    payload.resize(payload.size() + 16, 0);
    const absl::Status status =
        DecodeDss(WrapChunk(kControlTag, payload, true), RunContext()).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
    return std::string(status.message());
  };
  EXPECT_THAT(refusal(header), HasSubstr("control vertices"));
  header.vertex_count = 100;
  EXPECT_THAT(refusal(header), HasSubstr("control faces"));
}

// Layers too short for the number of vertices that the refinement has there.
TEST(DecodeDssTest, LayersBeyondTheLawAreRefused) {
  EncodedSurface encoded =
      *EncodeDss(SurfaceOver(Octahedron(), 0, kPositionStep, 1e-4), {}, {}, RunContext());
  std::vector<uint8_t> bytes = WithMaxLevel(encoded, 8);
  const std::vector<uint8_t> stub = {kEmptyLayer, 0};
  for (int level = 0; level <= 8; ++level) {
    const std::vector<uint8_t> chunk = WrapChunk(kHeightsTag, stub, false);
    bytes.insert(bytes.end(), chunk.begin(), chunk.end());
    const absl::Status status = DecodeExact(bytes).status();
    // An octahedron has 4^(l + 1) + 2 vertices at level l: 262146 at level 8.
    EXPECT_TRUE(status.ok()) << status;
  }
  encoded = *EncodeDss(SurfaceOver(Torus(5, 4), 0, kPositionStep, 1e-4), {}, {}, RunContext());
  bytes = WithMaxLevel(encoded, 8);
  for (int level = 0; level <= 8; ++level) {
    const std::vector<uint8_t> chunk = WrapChunk(kHeightsTag, stub, false);
    bytes.insert(bytes.end(), chunk.begin(), chunk.end());
    const absl::Status status = DecodeExact(bytes).status();
    // 20 * 4^l vertices: 327680 at level 7 are 65536 more than free, 256 bytes.
    EXPECT_EQ(status.ok(), level < 7) << status;
    if (level == 7) {
      EXPECT_EQ(status.code(), absl::StatusCode::kDataLoss);
      EXPECT_THAT(status.message(), HasSubstr("claim 327680 heights"));
    }
  }
}

std::vector<uint8_t> ExtraChunk(uint8_t tag) {
  std::vector<uint8_t> chunk = {tag, 3, 1, 2, 3};
  const uint32_t crc = Crc32c(chunk);
  for (int i = 0; i < 4; ++i) chunk.push_back(static_cast<uint8_t>(crc >> (8 * i)));
  return chunk;
}

TEST(DecodeDssTest, SkipsChunksThatMayBeSkippedAndNoOthers) {
  EncodedSurface encoded = EncodedSheet(2);
  encoded.chunks.insert(encoded.chunks.begin() + 2, ExtraChunk('x'));
  const auto skipped = DecodeExact(encoded.Concatenate());
  ASSERT_TRUE(skipped.ok()) << skipped.status();
  EXPECT_EQ(skipped->surface.max_level, 2);
  encoded.chunks[2] = ExtraChunk('X');
  EXPECT_EQ(DecodeExact(encoded.Concatenate()).status().code(), absl::StatusCode::kUnimplemented);
}

TEST(DecodeDssTest, StopsWhenAsked) {
  const std::vector<uint8_t> bytes = EncodedSheet(2).Concatenate();
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  EXPECT_EQ(DecodeDss(bytes, context).status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace rilievo
