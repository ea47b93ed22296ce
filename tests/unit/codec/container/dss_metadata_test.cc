#include "core/codec/container/dss_metadata.h"

#include <cmath>

#include "gtest/gtest.h"

namespace rilievo {
namespace {

DssMetadata Certificate() {
  DssMetadata metadata;
  metadata.generator = "rilievo 0.2";
  metadata.error_rms = 2.15e-4;
  metadata.error_mean = 1.6e-4;
  metadata.error_p95 = 4.5e-4;
  metadata.error_max = 7e-3;
  metadata.error_across = 1.9e-4;
  metadata.surface_to_scan = {2.1e-4, 1.5e-4, 4.4e-4, 6e-3};
  metadata.scan_to_surface = {2.2e-4, 1.7e-4, 4.6e-4, 7e-3};
  metadata.measured_share = 0.97;
  metadata.smoothed_share = 0.02;
  metadata.filled_share = 0.01;
  metadata.folds = 3;
  metadata.scan_points = 100000;
  metadata.topology = "arbitrary";
  for (int i = 0; i < 32; ++i) metadata.input_hash.push_back(static_cast<char>(8 * i));
  metadata.options = "--max-error 0.0003";
  return metadata;
}

std::vector<uint8_t> Write(const DssMetadata& metadata) {
  std::vector<uint8_t> bytes;
  ByteWriter writer(bytes);
  WriteMetadata(metadata, writer);
  return bytes;
}

void ExpectNear(const DssDistance& read, const DssDistance& written) {
  EXPECT_NEAR(read.rms / written.rms, 1, 2.5e-4);
  EXPECT_NEAR(read.mean / written.mean, 1, 2.5e-4);
  EXPECT_NEAR(read.p95 / written.p95, 1, 2.5e-4);
  EXPECT_NEAR(read.max / written.max, 1, 2.5e-4);
}

TEST(DssMetadataTest, EveryFieldComesBack) {
  const DssMetadata written = Certificate();
  const std::vector<uint8_t> bytes = Write(written);
  ByteReader reader(bytes);
  const DssMetadata read = ReadMetadata(reader);
  EXPECT_TRUE(reader.ok());
  EXPECT_EQ(reader.remaining(), 0u);
  EXPECT_EQ(read.generator, written.generator);
  EXPECT_EQ(read.error_rms, written.error_rms);
  EXPECT_EQ(read.error_max, written.error_max);
  EXPECT_NEAR(read.error_mean / written.error_mean, 1, 2.5e-4);
  EXPECT_NEAR(read.error_p95 / written.error_p95, 1, 2.5e-4);
  EXPECT_NEAR(read.error_across / written.error_across, 1, 2.5e-4);
  ExpectNear(read.surface_to_scan, written.surface_to_scan);
  ExpectNear(read.scan_to_surface, written.scan_to_surface);
  EXPECT_NEAR(read.measured_share, written.measured_share, 2.5e-4);
  EXPECT_NEAR(read.smoothed_share, written.smoothed_share, 2.5e-4);
  EXPECT_NEAR(read.filled_share, written.filled_share, 2.5e-4);
  EXPECT_EQ(read.folds, written.folds);
  EXPECT_EQ(read.scan_points, written.scan_points);
  EXPECT_EQ(read.topology, written.topology);
  EXPECT_EQ(read.input_hash, written.input_hash);
  EXPECT_EQ(read.options, written.options);
}

TEST(DssMetadataTest, ThePlaceComesBackAndTakesNothingWhereItIsUnknown) {
  const size_t without = Write(Certificate()).size();
  for (const double metres : {1.0, 0.001, 1200.0 / 3937}) {
    for (const UpDirection up : {UpDirection::kX, UpDirection::kZ, UpDirection::kMinusZ}) {
      DssMetadata written = Certificate();
      written.place = {metres, up, "PROJCS[\"ETRS89 / UTM zone 32N\"]"};
      const std::vector<uint8_t> bytes = Write(written);
      ByteReader reader(bytes);
      EXPECT_EQ(ReadMetadata(reader).place, written.place);
      EXPECT_EQ(reader.remaining(), 0u);
    }
  }
  DssMetadata metre = Certificate();
  metre.place.metres_per_unit = 1;
  EXPECT_EQ(Write(metre).size(), without + 2 + 1 + 2);
}

TEST(DssMetadataTest, APlaceThatIsNoneIsUnknown) {
  // Units of 0, -1 and infinity, a seventh way up, and fields without content.
  for (const std::vector<uint8_t>& field : std::vector<std::vector<uint8_t>>{{20, 1, 0},
                                                                             {20, 3, 2, 0xbf, 0xf0},
                                                                             {20, 3, 2, 0x7f, 0xf0},
                                                                             {20, 0},
                                                                             {21, 1, 6},
                                                                             {21, 0},
                                                                             {22, 0}}) {
    std::vector<uint8_t> bytes = field;
    bytes.push_back(0);
    ByteReader reader(bytes);
    EXPECT_EQ(ReadMetadata(reader).place, ScanPlace()) << int{field[0]};
    EXPECT_TRUE(reader.ok());
  }
}

TEST(DssMetadataTest, WhatFollowsFromBothWaysTakesNoBytes) {
  DssMetadata metadata = Certificate();
  const size_t with = Write(metadata).size();
  metadata.error_rms = std::sqrt((2.1e-4 * 2.1e-4 + 2.2e-4 * 2.2e-4) / 2);
  metadata.error_max = 7e-3;
  const std::vector<uint8_t> bytes = Write(metadata);
  EXPECT_EQ(bytes.size() + 20, with);
  ByteReader reader(bytes);
  const DssMetadata read = ReadMetadata(reader);
  EXPECT_NEAR(read.error_rms / metadata.error_rms, 1, 2.5e-4);
  EXPECT_NEAR(read.error_max / metadata.error_max, 1, 2.5e-4);
}

// What nearly every file holds stands in one field, common options in a byte a name.
TEST(DssMetadataTest, TheUsualTakesFewBytes) {
  DssMetadata written;
  written.generator = "rilievo 0.1.0";
  written.topology = "spherical";
  written.scan_points = 100000;
  written.folds = 0;
  written.input_hash = "01234567";
  written.options = "neighbors=12 max_error=0.001 seed=7";
  const std::vector<uint8_t> bytes = Write(written);
  EXPECT_EQ(bytes.size(), 2 + 3 + 1 + 3 + 1 + 8 + 2 + 12 + 1 + 5 + 2 + 1u);
  ByteReader reader(bytes);
  const DssMetadata read = ReadMetadata(reader);
  EXPECT_TRUE(reader.ok());
  EXPECT_EQ(read.generator, written.generator);
  EXPECT_EQ(read.topology, written.topology);
  EXPECT_EQ(read.scan_points, written.scan_points);
  EXPECT_EQ(read.folds, written.folds);
  EXPECT_EQ(read.input_hash, written.input_hash);
  EXPECT_EQ(read.options, written.options);
  // Whatever stands there.
  for (const char* options : {"", " ", "seed", "=3", "a=1", "seed=1  seed=2", "x seed=", "\x01",
                              "max_error=0.1", "a\x02 b"}) {
    written.options = options;
    const std::vector<uint8_t> again = Write(written);
    ByteReader from(again);
    EXPECT_EQ(ReadMetadata(from).options, options);
  }
}

TEST(DssMetadataTest, AnOriginThatIsCutOffIsUnknown) {
  const std::vector<uint8_t> bytes = {18, 5, 0, 1, 0, 2, 0x80, 0};
  ByteReader reader(bytes);
  const DssMetadata read = ReadMetadata(reader);
  EXPECT_TRUE(reader.ok());
  EXPECT_EQ(read.generator, "");
  EXPECT_EQ(read.folds, -1);
  EXPECT_EQ(read.scan_points, 0);
}

TEST(DssMetadataTest, NothingKnownTakesOneByte) {
  const std::vector<uint8_t> bytes = Write({});
  EXPECT_EQ(bytes, std::vector<uint8_t>{0});
  ByteReader reader(bytes);
  const DssMetadata read = ReadMetadata(reader);
  EXPECT_EQ(read.error_rms, -1);
  EXPECT_EQ(read.error_mean, -1);
  EXPECT_EQ(read.surface_to_scan.p95, -1);
  EXPECT_EQ(read.filled_share, -1);
  EXPECT_EQ(read.folds, -1);
}

TEST(DssMetadataTest, FiguresThatAreNoneAreUnknown) {
  DssMetadata metadata;
  metadata.error_mean = std::nan("");
  metadata.error_p95 = 0.5;
  metadata.folds = 0;
  const std::vector<uint8_t> bytes = Write(metadata);
  ByteReader reader(bytes);
  const DssMetadata read = ReadMetadata(reader);
  EXPECT_EQ(read.error_mean, -1);
  EXPECT_EQ(read.error_p95, 0.5);
  EXPECT_EQ(read.folds, 0);
}

TEST(DssMetadataTest, CutMetadataIsNoticed) {
  const std::vector<uint8_t> bytes = Write(Certificate());
  for (size_t size = 0; size < bytes.size(); ++size) {
    ByteReader reader{std::span(bytes).first(size)};
    ReadMetadata(reader);
    EXPECT_FALSE(reader.ok()) << size;
  }
}

TEST(DssMetadataTest, SmallFiguresKeepElevenDigitsFromNothingToFour) {
  for (double figure : {0.0, 1e-12, 0x1p-40, 3e-9, 1.0 / 3, 0.9999999, 1.0, 3.99}) {
    DssMetadata metadata;
    metadata.filled_share = figure;
    metadata.error_p95 = figure;
    const std::vector<uint8_t> bytes = Write(metadata);
    ByteReader reader(bytes);
    const DssMetadata read = ReadMetadata(reader);
    EXPECT_NEAR(read.filled_share, figure, figure * 0x1p-12 + 0x1p-41) << figure;
    EXPECT_EQ(read.error_p95, read.filled_share);
    EXPECT_EQ(read.error_mean, -1) << "between two that are known";
    EXPECT_EQ(read.measured_share, -1);
  }
  DssMetadata beyond;
  beyond.filled_share = 1e9;
  const std::vector<uint8_t> bytes = Write(beyond);
  ByteReader reader(bytes);
  EXPECT_NEAR(ReadMetadata(reader).filled_share, 4, 2e-3);
}

TEST(DssMetadataTest, OwnReleasesAndRoadsTakeFewBytes) {
  for (const char* generator :
       {"rilievo 0.1.0", "rilievo 12.300.7", "rilievo 1.2", "rilievo 1.2.03", "rilievo ",
        "another 1.2.3", "rilievo 1.2.3-rc", ""}) {
    DssMetadata metadata;
    metadata.generator = generator;
    const std::vector<uint8_t> bytes = Write(metadata);
    ByteReader reader(bytes);
    EXPECT_EQ(ReadMetadata(reader).generator, generator);
  }
  DssMetadata metadata;
  metadata.generator = "rilievo 0.1.0";
  metadata.topology = "arbitrary";
  EXPECT_EQ(Write(metadata).size(), 5u + 3 + 1);
  metadata.topology = "by sea";
  const std::vector<uint8_t> bytes = Write(metadata);
  ByteReader reader(bytes);
  EXPECT_EQ(ReadMetadata(reader).topology, "by sea");
}

}  // namespace
}  // namespace rilievo
