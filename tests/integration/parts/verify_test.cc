// What surfaces made by parts state of themselves.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/paging/scan_pager.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/verify_pages.h"
#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr PartSizes kThinnedSizes{
    .coarse_points = 3000, .part_points = 8192, .block_vertices = 2000};

Eigen::Matrix3Xd NoisyPoints(const std::string& shape) {
  ScannerOptions options;
  options.points = 9000;
  options.views = 0;
  options.noise = 0.0005;
  return SimulateScan(*MakeShape(shape).value(), options).value().cloud.points;
}

PagedScan Paged(const Eigen::Matrix3Xd& points) {
  ScanPager pager = ScanPager::Create(::testing::TempDir(), 5000).value();
  EXPECT_TRUE(pager.Add(points).ok());
  return pager.Finish(RunContext{}).value();
}

absl::StatusOr<Verification> VerifyOf(const std::vector<uint8_t>& dss,
                                      const Eigen::Matrix3Xd& points) {
  return VerifyPaged(dss, Paged(points), RunContext{});
}

// Closed, and open.
TEST(VerifyPagedTest, TheirScanConfirmsThemWhateverTheOrderOfItsPoints) {
  for (const std::string shape : {"genus2", "terrain"}) {
    const Eigen::Matrix3Xd points = NoisyPoints(shape);
    RunContext context;
    context.seed = 3;
    const Reconstruction made = ReconstructPaged(Paged(points), kThinnedSizes, {}, context).value();
    const std::vector<uint8_t> dss = made.encoded.Concatenate();
    const Verification verified = VerifyOf(dss, points.rowwise().reverse()).value();
    EXPECT_EQ(verified.scan, StatedScan::kSame);
    EXPECT_TRUE(verified.complete);
    EXPECT_EQ(verified.figures.size(), 18u);
    for (const CertifiedFigure& figure : verified.figures) {
      EXPECT_TRUE(figure.agrees) << shape << ": " << figure.name << " stated " << figure.stated
                                 << ", found " << figure.found;
    }
    EXPECT_TRUE(verified.agrees());
  }
}

class VerifyPagedFile : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    points_ = NoisyPoints("torus");
    made_ = ReconstructPaged(Paged(points_), kThinnedSizes, {}, RunContext{})->encoded;
  }

  static inline Eigen::Matrix3Xd points_;
  static inline EncodedSurface made_;
};

TEST_F(VerifyPagedFile, WhatItOverstatesIsFound) {
  EncodedSurface overstated = made_;
  DssMetadata metadata = DecodeDss(made_.Concatenate(), RunContext{})->metadata;
  metadata.error_rms *= 0.9;
  metadata.surface_to_scan.max *= 0.99;
  metadata.folds += 1;
  ASSERT_TRUE(ReplaceMetadata(metadata, overstated).ok());
  const Verification verified = VerifyOf(overstated.Concatenate(), points_).value();
  std::vector<std::string> differ;
  for (const CertifiedFigure& figure : verified.figures) {
    if (!figure.agrees) differ.push_back(figure.name);
  }
  EXPECT_THAT(differ, ::testing::UnorderedElementsAre("rms", "surface_to_scan_max", "folds"));
  EXPECT_FALSE(verified.agrees());
}

TEST_F(VerifyPagedFile, AnotherScanIsTold) {
  Eigen::Matrix3Xd other = points_;
  other(2, 77) += 1e-9;
  const Verification verified = VerifyOf(made_.Concatenate(), other).value();
  EXPECT_EQ(verified.scan, StatedScan::kOther);
  EXPECT_EQ(verified.figures.size(), 4u);  // folds and shares alone
  EXPECT_FALSE(verified.agrees());
}

TEST_F(VerifyPagedFile, MadeByPartsOrInMemoryItIsVerifiedSo) {
  const PointCloud cloud{points_};
  const DecodedSurface decoded = DecodeDss(made_.Concatenate(), RunContext{}).value();
  EXPECT_THAT(VerifyCertificate(decoded, &cloud, RunContext{}).status().message(),
              HasSubstr("verify it by parts"));
  const Reconstruction in_memory = Reconstruct(cloud, {}, RunContext{}).value();
  EXPECT_THAT(VerifyOf(in_memory.encoded.Concatenate(), points_).status().message(),
              HasSubstr("verify it without parts"));
}

}  // namespace
}  // namespace rilievo
