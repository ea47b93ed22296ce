// Files of every format version, frozen: what was written once must be read for ever, to the same
// numbers on every machine. Never change a golden file; a new version adds one.
#include <array>
#include <bit>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numeric>
#include <span>

#include "absl/status/status.h"
#include "core/codec/bytes/chunk.h"
#include "core/codec/bytes/crc32c.h"
#include "core/codec/container/decode_region.h"
#include "core/codec/container/dss.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/refinement.h"
#include "gtest/gtest.h"

namespace rilievo {
namespace {

std::vector<uint8_t> Golden(const char* name) {
  const std::filesystem::path path = std::filesystem::path(RILIEVO_GOLDEN_FOLDER) / name;
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// CRC-32C of values as little-endian 32-bit words.
class Fingerprint {
 public:
  void Add(uint32_t word) {
    for (int i = 0; i < 4; ++i) bytes_.push_back(static_cast<uint8_t>(word >> (8 * i)));
  }
  uint32_t Value() const { return Crc32c(bytes_); }

 private:
  std::vector<uint8_t> bytes_;
};

uint32_t FacesFingerprint(const ControlMesh& mesh) {
  Fingerprint fingerprint;
  for (Eigen::Index i = 0; i < mesh.faces.size(); ++i) {
    fingerprint.Add(static_cast<uint32_t>(mesh.faces.data()[i]));
  }
  return fingerprint.Value();
}

uint32_t PointsFingerprint(const ControlMesh& mesh) {
  Fingerprint fingerprint;
  for (Eigen::Index i = 0; i < mesh.vertices.size(); ++i) {
    const uint64_t bits = std::bit_cast<uint64_t>(mesh.vertices.data()[i] + 0.0);  // no -0
    fingerprint.Add(static_cast<uint32_t>(bits));
    fingerprint.Add(static_cast<uint32_t>(bits >> 32));
  }
  return fingerprint.Value();
}

uint32_t HeightsFingerprint(const DisplacedSurface& surface) {
  Fingerprint fingerprint;
  for (size_t v = 0; v < surface.heights.size(); ++v) {
    fingerprint.Add(std::bit_cast<uint32_t>(surface.heights[v] + 0.0f));
    fingerprint.Add(static_cast<uint32_t>(surface.sources[v]));
  }
  return fingerprint.Value();
}

// A sheet with a hole beside an octahedron, heights of two levels beyond the control mesh.
TEST(GoldenTest, Version1) {
  const std::vector<uint8_t> bytes = Golden("sheet_and_octahedron_v1.dss");
  ASSERT_EQ(bytes.size(), 713u);
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->format_version, 1);
  EXPECT_EQ(decoded->declared_max_level, 2);
  EXPECT_EQ(decoded->metadata.generator, "rilievo 0.1.0");
  EXPECT_EQ(decoded->metadata.error_rms, 1.5e-4);
  EXPECT_EQ(decoded->metadata.error_max, 2e-3);
  EXPECT_EQ(decoded->metadata.scan_points, 9218);
  EXPECT_EQ(decoded->metadata.topology, "arbitrary");
  const DisplacedSurface& surface = decoded->surface;
  EXPECT_EQ(surface.frame.center, Eigen::Vector3d(512345.25, 4612345.5, 210.75));
  EXPECT_EQ(surface.frame.diagonal, 123.456);
  const TopologySummary summary = SummarizeTopology(
      surface.control_mesh.faces, static_cast<int>(surface.control_mesh.vertices.cols()));
  EXPECT_EQ(summary.vertices, 36);
  EXPECT_EQ(summary.faces, 46);
  EXPECT_EQ(summary.components, 2);
  EXPECT_EQ(summary.boundary_loops, 2);
  EXPECT_EQ(FacesFingerprint(surface.control_mesh), 3325842326u);
  EXPECT_EQ(PointsFingerprint(surface.control_mesh), 816305827u);
  EXPECT_EQ(surface.heights.size(), 414u);
  EXPECT_EQ(HeightsFingerprint(surface), 861849492u);
}

// The same meshes with creases and a corner, three levels beyond the control mesh, a certificate.
TEST(GoldenTest, Version2) {
  const std::vector<uint8_t> bytes = Golden("sheet_and_octahedron_v2.dss");
  ASSERT_EQ(bytes.size(), 942u);
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->format_version, 2);
  EXPECT_EQ(decoded->declared_max_level, 3);
  EXPECT_EQ(decoded->chunk_bytes, (std::vector<int64_t>{282, 58, 83, 159, 360}));
  const DssMetadata& metadata = decoded->metadata;
  EXPECT_EQ(metadata.generator, "rilievo 0.2.0");
  EXPECT_EQ(metadata.error_rms, 1.5e-4);
  EXPECT_EQ(metadata.error_mean, 0x1p-13);
  EXPECT_EQ(metadata.error_p95, 0x1p-11);
  EXPECT_EQ(metadata.error_max, 2e-3);
  EXPECT_EQ(metadata.surface_to_scan.p95, 0.5);
  EXPECT_EQ(metadata.scan_to_surface.max, 2);
  EXPECT_EQ(metadata.measured_share, 0.875);
  EXPECT_EQ(metadata.filled_share, 0.0625);
  EXPECT_EQ(metadata.folds, 1);
  EXPECT_EQ(metadata.scan_points, 9218);
  EXPECT_EQ(metadata.topology, "arbitrary");
  EXPECT_EQ(metadata.input_hash, "0123456789abcdef");
  EXPECT_EQ(metadata.options, "--max-error 0.0002");
  const DisplacedSurface& surface = decoded->surface;
  EXPECT_EQ(surface.frame.center, Eigen::Vector3d(512345.25, 4612345.5, 210.75));
  EXPECT_EQ(surface.frame.diagonal, 123.456);
  const std::vector<Crease> creases = {
      {0, 5, 2.5f}, {30, 31, kInfiniteSharpness}, {30, 32, kInfiniteSharpness}};
  EXPECT_EQ(surface.control_mesh.creases, creases);
  EXPECT_EQ(surface.control_mesh.corners, std::vector<int>{30});
  EXPECT_EQ(FacesFingerprint(surface.control_mesh), 3506611630u);
  EXPECT_EQ(PointsFingerprint(surface.control_mesh), 3417436706u);
  EXPECT_EQ(surface.heights.size(), 1562u);
  EXPECT_EQ(HeightsFingerprint(surface), 3594217160u);
}

// A torus of 288 faces in groups, heights of three levels and a certificate.
TEST(GoldenTest, Version3) {
  const std::vector<uint8_t> bytes = Golden("torus_in_groups_v3.dss");
  ASSERT_EQ(bytes.size(), 1579u);
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->format_version, 3);
  EXPECT_EQ(decoded->declared_max_level, 3);
  EXPECT_EQ(decoded->chunk_bytes, (std::vector<int64_t>{526, 118, 121, 242, 572}));
  const DssMetadata& metadata = decoded->metadata;
  EXPECT_EQ(metadata.generator, "rilievo 0.3.0");
  EXPECT_EQ(metadata.surface_to_scan.rms, 0x1p-13);
  EXPECT_EQ(metadata.surface_to_scan.p95, 0x1p-12);
  EXPECT_EQ(metadata.scan_to_surface.max, 2);
  EXPECT_EQ(metadata.error_rms, 0x1p-13);
  EXPECT_EQ(metadata.error_p95, 0x1p-11);
  EXPECT_EQ(metadata.error_max, 2);
  EXPECT_EQ(metadata.measured_share, 0.875);
  EXPECT_EQ(metadata.smoothed_share, 0.0625);
  EXPECT_EQ(metadata.folds, 1);
  EXPECT_EQ(metadata.scan_points, 9218);
  EXPECT_EQ(metadata.topology, "arbitrary");
  EXPECT_EQ(metadata.input_hash, "01234567");
  EXPECT_EQ(metadata.options, "--max-error 0.0002");
  const DisplacedSurface& surface = decoded->surface;
  EXPECT_EQ(surface.control_mesh.faces.cols(), 288);
  EXPECT_EQ(FacesFingerprint(surface.control_mesh), 497254194u);
  EXPECT_EQ(PointsFingerprint(surface.control_mesh), 3987911923u);
  EXPECT_EQ(surface.heights.size(), 9216u);
  EXPECT_EQ(HeightsFingerprint(surface), 2738325827u);
  const std::vector<int> faces = {0, 100};
  const auto region = DecodeRegion(bytes, faces, kFinestLevel, RunContext());
  ASSERT_TRUE(region.ok()) << region.status();
  EXPECT_EQ(region->groups, 4);
}

// Levels without a chunk, all heights smoothed, the origin in one field, short options.
TEST(GoldenTest, Version3WithPlainLevels) {
  const std::vector<uint8_t> bytes = Golden("genus2_plain_levels_v3.dss");
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->format_version, 3);
  EXPECT_EQ(decoded->chunk_bytes, (std::vector<int64_t>{216, 7, 13}));
  EXPECT_EQ(decoded->declared_max_level, 4);
  EXPECT_EQ(decoded->surface.max_level, 4);
  const DssMetadata& metadata = decoded->metadata;
  EXPECT_TRUE(metadata.all_smoothed);
  EXPECT_EQ(metadata.plain_levels, (std::vector<uint8_t>{1, 1, 1}));
  EXPECT_EQ(metadata.generator, "rilievo 0.1.0");
  EXPECT_EQ(metadata.topology, "arbitrary");
  EXPECT_EQ(metadata.scan_points, 20000);
  EXPECT_EQ(metadata.folds, 0);
  EXPECT_EQ(metadata.input_hash.size(), 8u);
  EXPECT_EQ(metadata.options, "max_error=0.004");
  EXPECT_EQ(decoded->surface.heights.size(), 8446u);
  EXPECT_EQ(HeightsFingerprint(decoded->surface), 1819703116u);
}

// Smoothed heights told from measured ones, without groups and with them.
TEST(GoldenTest, Version3WithSmoothedHeights) {
  struct Expected {
    const char* name;
    std::vector<int64_t> chunk_bytes;
    std::array<int64_t, 3> sources;
    uint32_t heights;
  };
  for (const Expected& expected : {Expected{"torus_and_sheet_smoothed_v3.dss",
                                            {288, 73, 111, 129, 54, 54},
                                            {1557, 1369, 354},
                                            2032656050u},
                                   Expected{"torus_and_sheet_smoothed_in_groups_v3.dss",
                                            {607, 188, 240, 408, 979, 109},
                                            {4655, 4471, 1130},
                                            1859283995u}}) {
    SCOPED_TRACE(expected.name);
    const std::vector<uint8_t> bytes = Golden(expected.name);
    const auto decoded = DecodeDss(bytes, RunContext());
    ASSERT_TRUE(decoded.ok()) << decoded.status();
    EXPECT_EQ(decoded->format_version, 3);
    EXPECT_EQ(decoded->chunk_bytes, expected.chunk_bytes);
    EXPECT_FALSE(decoded->metadata.all_smoothed);
    std::array<int64_t, 3> sources{};
    for (HeightSource source : decoded->surface.sources) ++sources[static_cast<size_t>(source)];
    EXPECT_EQ(sources, expected.sources);
    EXPECT_EQ(HeightsFingerprint(decoded->surface), expected.heights);
    const std::vector<int> faces = {0, 60};
    const auto region = DecodeRegion(bytes, faces, kFinestLevel, RunContext());
    ASSERT_TRUE(region.ok()) << region.status();
    for (size_t v = 0; v < region->sources.size(); ++v) {
      EXPECT_EQ(region->sources[v], decoded->surface.sources[region->region.vertices[v]]);
    }
  }
}

// The torus of Version3 in groups, whose cage was bent: it tells its groups.
TEST(GoldenTest, Version4) {
  const std::vector<uint8_t> bytes = Golden("bent_torus_in_groups_v4.dss");
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->format_version, 4);
  EXPECT_EQ(decoded->chunk_bytes, (std::vector<int64_t>{1393, 118, 121, 242, 572}));
  const DisplacedSurface& surface = decoded->surface;
  ASSERT_EQ(surface.control_mesh.creases.size(), 1u);
  EXPECT_EQ(surface.control_mesh.creases[0].sharpness, 2.5f);
  EXPECT_EQ(PointsFingerprint(surface.control_mesh), 1580947596u);
  EXPECT_EQ(HeightsFingerprint(surface), 2738325827u);
  const std::vector<int> faces = {0, 100};
  const auto region = DecodeRegion(bytes, faces, kFinestLevel, RunContext());
  ASSERT_TRUE(region.ok()) << region.status();
  EXPECT_EQ(region->groups, 4);
}

// A torus whose heights and colours stand in groups from level 2 on.
TEST(GoldenTest, Colours) {
  const std::vector<uint8_t> bytes = Golden("colored_torus_in_groups_v3.dss");
  ASSERT_EQ(bytes.size(), 4364u);
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->color_bytes, 291);
  EXPECT_EQ(decoded->chunk_bytes.size(), 6u) << "control mesh, levels with their colours, flags";
  ASSERT_EQ(decoded->surface.colors.size(), 5120u);
  std::vector<uint8_t> channels;
  for (const Rgb& color : decoded->surface.colors) {
    channels.insert(channels.end(), color.begin(), color.end());
  }
  EXPECT_EQ(Crc32c(channels), 0x4282ba08u);
}

// The torus of Version3 with two updates behind it, which together have every kind of flags.
TEST(GoldenTest, Updates) {
  const std::vector<uint8_t> bytes = Golden("updated_torus_in_groups_v3.dss");
  ASSERT_EQ(bytes.size(), 2145u);
  EXPECT_EQ(Golden("torus_in_groups_v3.dss"),
            std::vector<uint8_t>(bytes.begin(), bytes.begin() + 1579));
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  // What follows a file by its chunks, such as the viewer, gets to the updates.
  const std::vector<int64_t>& chunks = decoded->chunk_bytes;
  EXPECT_EQ(chunks.size(), 5u);
  EXPECT_EQ(std::accumulate(chunks.begin(), chunks.end(), int64_t{0}), 2145);
  EXPECT_EQ(decoded->metadata.generator, "rilievo 0.4.0");
  EXPECT_EQ(decoded->metadata.folds, -1);
  EXPECT_NEAR(decoded->metadata.measured_share, 8199.0 / 9216, 5e-4);
  EXPECT_EQ(HeightsFingerprint(decoded->surface), 3720706704u);
}

// A torus of quads, some edges of which are creases.
TEST(GoldenTest, Version5OfQuads) {
  const std::vector<uint8_t> bytes = Golden("quad_torus_v5.dss");
  ASSERT_EQ(bytes.size(), 2361u);
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->format_version, 5);
  EXPECT_EQ(decoded->chunk_bytes, (std::vector<int64_t>{409, 130, 232, 415, 1118, 57}));
  const ControlMesh& mesh = decoded->surface.control_mesh;
  EXPECT_EQ(mesh.creases.size(), 20u);
  EXPECT_EQ(FacesFingerprint(mesh), 800352612u);
  ASSERT_EQ(mesh.diagonals.size(), 96u);
  Fingerprint diagonals;
  for (const auto& ends : mesh.diagonals) {
    for (const int end : ends) diagonals.Add(static_cast<uint32_t>(end));
  }
  EXPECT_EQ(diagonals.Value(), 1171173543u);
  EXPECT_EQ(decoded->surface.heights.size(), 6144u);
  EXPECT_EQ(HeightsFingerprint(decoded->surface), 3759793190u);
}

// A sheet with a hole, whose border has eight more digits.
TEST(GoldenTest, Version6OfAFineBorder) {
  const std::vector<uint8_t> bytes = Golden("fine_border_v6.dss");
  ASSERT_EQ(bytes.size(), 1438u);
  const auto decoded = DecodeDss(bytes, RunContext());
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->format_version, 6);
  EXPECT_EQ(decoded->chunk_bytes, (std::vector<int64_t>{}));
  EXPECT_EQ(FacesFingerprint(decoded->surface.control_mesh), 0u);
  EXPECT_EQ(PointsFingerprint(decoded->surface.control_mesh), 0u);
  EXPECT_EQ(HeightsFingerprint(decoded->surface), 0u);
}

// Whatever the control chunk is made to say, with a good checksum, it is refused or its faces are
// halves of quads.
TEST(GoldenTest, DamagedQuadsAreQuadsOrRefused) {
  const std::vector<uint8_t> bytes = Golden("quad_torus_v5.dss");
  const auto list = ListChunks(bytes);
  ASSERT_TRUE(list.ok()) << list.status();
  const std::span<const uint8_t> payload = list->chunks.front().payload;
  int decodes = 0, refusals = 0;
  for (size_t i = 0; i < payload.size(); ++i) {
    for (const int bit : {0, 4, 7}) {
      std::vector<uint8_t> damaged(payload.begin(), payload.end());
      damaged[i] ^= static_cast<uint8_t>(1 << bit);
      const auto decoded =
          DecodeControlChunk(WrapChunk(list->chunks.front().tag, damaged, true, 5), RunContext());
      if (!decoded.ok()) {
        EXPECT_TRUE(absl::IsDataLoss(decoded.status())) << decoded.status();
        ++refusals;
        continue;
      }
      const ControlMesh& mesh = decoded->surface.control_mesh;
      EXPECT_EQ(2 * static_cast<Eigen::Index>(mesh.diagonals.size()), mesh.faces.cols());
      EXPECT_TRUE(RefineTopology(mesh, 1, RunContext()).ok()) << "byte " << i << ", bit " << bit;
      ++decodes;
    }
  }
  EXPECT_GT(decodes, 100);
  EXPECT_GT(refusals, 100);
}

}  // namespace
}  // namespace rilievo
