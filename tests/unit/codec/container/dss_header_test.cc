#include "core/codec/container/dss_header.h"

#include <cmath>
#include <limits>

#include "core/codec/bytes/stored_step.h"
#include "gtest/gtest.h"

namespace rilievo {
namespace {

DssHeader Sample() {
  DssHeader header;
  header.vertex_count = 1234;
  header.face_count = 2464;
  header.has_boundary = true;
  header.max_level = 5;
  header.frame.center = {500000.125, 4600000.5, -3};
  header.frame.diagonal = 812.75;
  header.position_step = StoredStep(1e-4);
  header.height_unit = StoredStep(2e-5);
  header.has_filled = true;
  header.has_creases = true;
  header.metadata.generator = "rilievo \xc3\xa9";
  header.metadata.error_rms = 0;
  header.metadata.error_max = 1.5e-3;
  header.metadata.scan_points = int64_t{1} << 40;
  header.metadata.topology = "planar";
  return header;
}

TEST(DssHeaderTest, RoundTrips) {
  const DssHeader header = Sample();
  const auto decoded = DecodeDssHeader(EncodeDssHeader(header), 2);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->vertex_count, header.vertex_count);
  EXPECT_EQ(decoded->face_count, header.face_count);
  EXPECT_EQ(decoded->has_boundary, header.has_boundary);
  EXPECT_EQ(decoded->has_filled, header.has_filled);
  EXPECT_EQ(decoded->has_creases, header.has_creases);
  EXPECT_EQ(decoded->max_level, header.max_level);
  EXPECT_EQ(decoded->frame.center, header.frame.center);
  EXPECT_EQ(decoded->frame.diagonal, header.frame.diagonal);
  EXPECT_EQ(decoded->position_step, header.position_step);
  EXPECT_EQ(decoded->height_unit, header.height_unit);
  EXPECT_EQ(decoded->metadata.generator, header.metadata.generator);
  EXPECT_EQ(decoded->metadata.error_rms, header.metadata.error_rms);
  EXPECT_EQ(decoded->metadata.error_max, header.metadata.error_max);
  EXPECT_EQ(decoded->metadata.scan_points, header.metadata.scan_points);
  EXPECT_EQ(decoded->metadata.topology, header.metadata.topology);
}

TEST(DssHeaderTest, StoredStepsHaveTwelveBinaryDigits) {
  for (double step : {1e-9, 1.5e-3, 0.01, 1.0, 0.25}) {
    const double stored = StoredStep(step);
    EXPECT_NEAR(stored / step, 1, 0x1p-13);
    EXPECT_EQ(StoredStep(stored), stored);
  }
  EXPECT_EQ(StoredStep(0.25), 0.25);
  EXPECT_EQ(StoredStep(1 + 0x1p-12), 1 + 0x1p-12);
}

// 4 bytes for what a small file needs: counts, level, frame of a unit cube, two steps.
TEST(DssHeaderTest, SmallNumbersTakeFewBytes) {
  DssHeader header;
  header.vertex_count = 100;
  header.face_count = 120;
  header.position_step = 1e-3;
  header.height_unit = 1e-6;
  // flags, two counts, level; three zeros of one byte; 1.0 in two and its count; two steps of
  // three and theirs; the end of the metadata.
  EXPECT_EQ(EncodeDssHeader(header).size(), 4u + 3u + 3u + 8u + 1u);
}

TEST(DssHeaderTest, LevelsWithoutAChunkMustBePossible) {
  DssHeader header = Sample();
  header.metadata.plain_levels = {1, 0, 3};
  const auto decoded = DecodeDssHeader(EncodeDssHeader(header), 3);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->metadata.plain_levels, header.metadata.plain_levels);
  EXPECT_EQ(decoded->layer_count(), 3);
  // Versions before have none.
  EXPECT_EQ(DecodeDssHeader(EncodeDssHeader(header), 2)->layer_count(), 6);
  header.metadata.plain_levels = {1, 4};
  EXPECT_EQ(DecodeDssHeader(EncodeDssHeader(header), 3).status().code(),
            absl::StatusCode::kDataLoss);
  header.metadata.plain_levels.assign(6, 0);
  EXPECT_EQ(DecodeDssHeader(EncodeDssHeader(header), 3).status().code(),
            absl::StatusCode::kDataLoss);
  header.metadata.plain_levels.resize(5);
  EXPECT_TRUE(DecodeDssHeader(EncodeDssHeader(header), 3).ok());
  header.group_limit = 128;
  EXPECT_EQ(DecodeDssHeader(EncodeDssHeader(header), 3).status().code(),
            absl::StatusCode::kDataLoss);
}

// Versions 4 to 6 are for files of groups that tell which they are, of quads, and with a finer
// border.
TEST(DssHeaderTest, ANewerVersionNeedsItsFlag) {
  DssHeader header = Sample();
  EXPECT_TRUE(DecodeDssHeader(EncodeDssHeader(header), 3).ok());
  for (const int version : {4, 5, 6}) {
    EXPECT_TRUE(absl::IsDataLoss(DecodeDssHeader(EncodeDssHeader(header), version).status()));
  }
  header.group_limit = 1000;
  header.tells_groups = true;
  EXPECT_TRUE(DecodeDssHeader(EncodeDssHeader(header), 4).ok());
  EXPECT_TRUE(absl::IsDataLoss(DecodeDssHeader(EncodeDssHeader(header), 5).status()));
  header.has_quads = true;
  EXPECT_TRUE(absl::IsDataLoss(DecodeDssHeader(EncodeDssHeader(header), 4).status()));
  EXPECT_TRUE(DecodeDssHeader(EncodeDssHeader(header), 5).ok());
  header.has_boundary = true;
  header.border_digits = 16;
  EXPECT_TRUE(absl::IsDataLoss(DecodeDssHeader(EncodeDssHeader(header), 5).status()));
  EXPECT_EQ(DecodeDssHeader(EncodeDssHeader(header), 6)->border_digits, 16);
  header.border_digits = 17;
  EXPECT_TRUE(absl::IsDataLoss(DecodeDssHeader(EncodeDssHeader(header), 6).status()));
  header.border_digits = 1;
  header.has_boundary = false;
  EXPECT_TRUE(absl::IsDataLoss(DecodeDssHeader(EncodeDssHeader(header), 6).status()));
}

TEST(DssHeaderTest, UnknownMetadataIsSkipped) {
  std::vector<uint8_t> bytes = EncodeDssHeader(Sample());
  ASSERT_EQ(bytes.back(), 0);  // the end of the metadata
  bytes.back() = 99;
  for (uint8_t byte : {2, 0xde, 0xad, 0}) bytes.push_back(byte);
  const auto decoded = DecodeDssHeader(bytes, 2);
  ASSERT_TRUE(decoded.ok()) << decoded.status();
  EXPECT_EQ(decoded->metadata.topology, "planar");
}

TEST(DssHeaderTest, EveryPrefixIsDataLoss) {
  const std::vector<uint8_t> bytes = EncodeDssHeader(Sample());
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(DecodeDssHeader(std::span(bytes).first(size), 2).status().code(),
              absl::StatusCode::kDataLoss);
  }
}

TEST(DssHeaderTest, ImpossibleValuesAreDataLoss) {
  const auto refused = [](void (*change)(DssHeader&)) {
    DssHeader header = Sample();
    change(header);
    return DecodeDssHeader(EncodeDssHeader(header), 2).status().code() ==
           absl::StatusCode::kDataLoss;
  };
  EXPECT_TRUE(refused([](DssHeader& h) { h.vertex_count = 2; }));
  EXPECT_TRUE(refused([](DssHeader& h) { h.face_count = 0; }));
  EXPECT_TRUE(refused([](DssHeader& h) { h.vertex_count = (1 << 28) + 1; }));
  EXPECT_TRUE(refused([](DssHeader& h) { h.max_level = 9; }));
  EXPECT_TRUE(refused([](DssHeader& h) { h.frame.diagonal = 0; }));
  EXPECT_TRUE(refused([](DssHeader& h) { h.frame.center[1] = std::nan(""); }));
  EXPECT_TRUE(refused([](DssHeader& h) { h.position_step = -1; }));
  EXPECT_TRUE(
      refused([](DssHeader& h) { h.height_unit = std::numeric_limits<double>::infinity(); }));
  EXPECT_TRUE(refused([](DssHeader& h) { h.position_step = 1e300; }));
  EXPECT_TRUE(refused([](DssHeader& h) { h.height_unit = 0.02; }));
  EXPECT_TRUE(refused([](DssHeader& h) { h.frame.diagonal = 1e305; }));
  EXPECT_FALSE(refused([](DssHeader&) {}));
}

}  // namespace
}  // namespace rilievo
