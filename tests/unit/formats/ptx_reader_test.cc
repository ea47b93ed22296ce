// PTX: transforms, several clouds, and what a broken grid says.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "client/formats/file_kind.h"
#include "client/formats/scan_reader.h"
#include "tests/unit/formats/scan_samples.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using testing::kIdentity;
using testing::PtxCloud;

absl::StatusOr<ScanFile> ReadPtx(const std::string& bytes, const WantedLayers& wanted = {}) {
  std::istringstream in(bytes);
  return ReadPtxScan(in, wanted);
}

void ExpectPtxRefused(const std::string& bytes, absl::StatusCode code, const std::string& part) {
  const auto scan = ReadPtx(bytes);
  ASSERT_FALSE(scan.ok());
  EXPECT_EQ(scan.status().code(), code) << scan.status();
  EXPECT_THAT(std::string(scan.status().message()), HasSubstr(part));
}

// A quarter turn about z (x to y), then a map grid: rows of the matrix are the images of the axes.
constexpr char kTurned[] = "0 1 0 0\n-1 0 0 0\n0 0 1 0\n4600000.001 5500000.002 300 1\n";

TEST(PtxReaderTest, CloudsAreMovedIntoOneFrame) {
  const auto scan = ReadPtx(PtxCloud(2, 1, kIdentity, "1 2 3 0.5\n4 5 6 0.25\n") +
                                PtxCloud(1, 2, kTurned, "1 0 0 0.125\n0 2 1 1\n\n"),
                            {.intensity = true, .colors = true});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->format, "PTX, 2 clouds");
  Eigen::Matrix3Xd expected(3, 4);
  expected << 1, 4, 4600000.001, 4600000.001 - 2,  //
      2, 5, 5500000.002 + 1, 5500000.002,          //
      3, 6, 300, 301;
  ASSERT_EQ(scan->cloud.points.cols(), 4);
  EXPECT_LT((scan->cloud.points - expected).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_THAT(scan->layers.intensity, ::testing::ElementsAre(0.5f, 0.25f, 0.125f, 1.0f));
  EXPECT_TRUE(scan->cloud.sights.colors.empty());
}

TEST(PtxReaderTest, RaysWithoutReturnAreLeftOutAndColorsKept) {
  const auto scan = ReadPtx(
      PtxCloud(3, 1, kTurned, "0 0 0 0.5 0 0 0\n1 0 0 0.5 10 300 -4\n0.000 0 -0 0.5 1 2 3\n"),
      {.colors = true});
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_EQ(scan->format, "PTX, 1 cloud, 2 rays without a return");
  ASSERT_EQ(scan->cloud.points.cols(), 1);
  ASSERT_EQ(scan->cloud.sights.colors.size(), 1u);
  EXPECT_EQ(scan->cloud.sights.colors[0], (std::array<uint8_t, 3>{10, 255, 0}));
  EXPECT_TRUE(scan->layers.intensity.empty());
}

TEST(PtxReaderTest, IsKnownByContentAndPtsIsNotTakenForIt) {
  const std::string ptx = PtxCloud(2, 1, kIdentity, "1 2 3 0.5\n4 5 6 0.25\n");
  EXPECT_EQ(*RecognizeFile(ptx, ptx.size(), "cloud"), FileKind::kPtx);
  EXPECT_EQ(*RecognizeFile("2\n1 2 3\n4 5 6\n", 14, "cloud"), FileKind::kXyz);
  EXPECT_EQ(*RecognizeFile("0\n1\n5 5 5\n", 10, "cloud"), FileKind::kXyz);
}

TEST(PtxReaderTest, WhatIsBrokenIsNamed) {
  constexpr auto kInvalid = absl::StatusCode::kInvalidArgument;
  constexpr auto kLost = absl::StatusCode::kDataLoss;
  const std::string two = "1 2 3 0.5\n4 5 6 0.25\n";
  ExpectPtxRefused("", kInvalid, "no cloud");
  ExpectPtxRefused("2\nx\n", kInvalid,
                   "line 2: the number of rows of cloud 1 is due, there is 'x'");
  ExpectPtxRefused("-2\n", kInvalid, "'-2'");
  ExpectPtxRefused(PtxCloud(0, 5, kIdentity, two), kInvalid, "line 2");
  ExpectPtxRefused("18446744073709551615\n18446744073709551615\n", kInvalid, "not possible");
  ExpectPtxRefused(PtxCloud(100000, 100000, kIdentity, two), kLost, "10000000000");
  ExpectPtxRefused(PtxCloud(3, 1, kIdentity, two), kLost, "cloud 1");
  ExpectPtxRefused(PtxCloud(2, 1, kIdentity, two) + "7\n", kLost, "header of cloud 2");
  ExpectPtxRefused(PtxCloud(1, 1, kIdentity, two), kInvalid, "line 12: the number of columns");
  ExpectPtxRefused(PtxCloud(2, 1, kIdentity, "1 2 3 0.5\n4 5\n"), kInvalid, "line 12: 2 values");
  ExpectPtxRefused(PtxCloud(2, 1, kIdentity, "1 2 z 0.5\n4 5 6\n"), kInvalid, "line 11: 'z'");
  ExpectPtxRefused(PtxCloud(2, 1, "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 1 2\n", two), kInvalid,
                   "line 10: the last column of the transform");
  ExpectPtxRefused(PtxCloud(2, 1, "1 0 0 0\n0 1 0 0\n0 0 inf 0\n0 0 1 1\n", two), kInvalid,
                   "line 9");
  ExpectPtxRefused(PtxCloud(2, 1, "1 0 0\n0 1 0 0\n0 0 1 0\n0 0 1 1\n", two), kInvalid, "line 7");
  ExpectPtxRefused(PtxCloud(2, 1, kIdentity, "0 0 0 1\n0 0 0 1\n"), kInvalid, "no ray");
}

}  // namespace
}  // namespace rilievo
