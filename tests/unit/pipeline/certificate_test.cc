#include "core/pipeline/certificate.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/pipeline/reconstruct.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

PointCloud Scan(const std::string& name, int points) {
  ScannerOptions options;
  options.points = points;
  options.views = 0;
  options.noise = 2e-4;
  return SimulateScan(*MakeShape(name).value(), options).value().cloud;
}

TEST(CertificateTest, TheHashIsThatOfTheNumbers) {
  PointCloud scan{Eigen::Matrix3Xd::Random(3, 5000)};
  const std::string hash = HashOfScan(scan);
  EXPECT_EQ(hash.size(), kHashBytes);
  PointCloud other = scan;
  EXPECT_EQ(HashOfScan(other), hash);
  other.points(2, 4999) = std::nextafter(other.points(2, 4999), 2.0);
  EXPECT_NE(HashOfScan(other), hash);
  // Whatever kind of no number.
  scan.points(0, 7) = std::numeric_limits<double>::quiet_NaN();
  other = scan;
  other.points(0, 7) = -std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(HashOfScan(other), HashOfScan(scan));
}

TEST(CertificateTest, EveryShapesFileIsConfirmedByItsScan) {
  for (const std::string& name : ShapeNames()) {
    const PointCloud scan = Scan(name, 5000);
    RunContext context;
    context.seed = 3;
    const auto made = Reconstruct(scan, {}, context);
    ASSERT_TRUE(made.ok()) << name << ": " << made.status();
    const DecodedSurface decoded = DecodeDss(made->encoded.Concatenate(), RunContext()).value();
    EXPECT_NEAR(decoded.metadata.error_rms / made->report.error.rms, 1, 2.5e-4) << name;
    const auto verified = VerifyCertificate(decoded, &scan, RunContext());
    ASSERT_TRUE(verified.ok()) << name << ": " << verified.status();
    EXPECT_EQ(verified->scan, StatedScan::kSame) << name;
    EXPECT_EQ(verified->figures.size(), 18u) << name;
    for (const CertifiedFigure& figure : verified->figures) {
      EXPECT_TRUE(figure.agrees) << name << ": " << figure.name << " stated " << figure.stated
                                 << ", found " << figure.found;
    }
    EXPECT_TRUE(verified->agrees()) << name;
    EXPECT_EQ(decoded.metadata.generator.substr(0, 8), "rilievo ") << name;
  }
}

class VerifyTest : public ::testing::Test {
 protected:
  void SetUp() override {
    scan_ = Scan("torus", 6000);
    encoded_ = Reconstruct(scan_, {}, RunContext()).value().encoded;
    decoded_ = DecodeDss(encoded_.Concatenate(), RunContext()).value();
  }
  Verification Verify(const PointCloud* scan) const {
    return VerifyCertificate(decoded_, scan, RunContext()).value();
  }
  PointCloud scan_;
  EncodedSurface encoded_;
  DecodedSurface decoded_;
};

TEST_F(VerifyTest, WithoutTheScanTheRestIsChecked) {
  const Verification verified = Verify(nullptr);
  EXPECT_TRUE(verified.agrees());
  EXPECT_EQ(verified.figures.size(), 4u);  // folds, two shares, sum_of_shares
}

TEST_F(VerifyTest, AnotherScanIsTold) {
  PointCloud other = scan_;
  other.points(0, 0) += 1e-12;
  EXPECT_EQ(Verify(&other).scan, StatedScan::kOther);
  EXPECT_FALSE(Verify(&other).agrees());
}

TEST_F(VerifyTest, EveryFalseFigureIsTold) {
  const DssMetadata truth = decoded_.metadata;
  const auto differing = [&] {
    std::vector<std::string> names;
    for (const CertifiedFigure& figure : Verify(&scan_).figures) {
      if (!figure.agrees) names.push_back(figure.name);
    }
    return names;
  };
  EXPECT_TRUE(differing().empty());
  decoded_.metadata.error_rms *= 0.999;
  EXPECT_EQ(differing(), std::vector<std::string>{"rms"});
  decoded_.metadata = truth;
  decoded_.metadata.scan_to_surface.max *= 0.9;
  EXPECT_EQ(differing(), std::vector<std::string>{"scan_to_surface_max"});
  decoded_.metadata = truth;
  decoded_.metadata.folds += 1;
  EXPECT_EQ(differing(), std::vector<std::string>{"folds"});
  decoded_.metadata = truth;
  decoded_.metadata.measured_share = 0.5;
  EXPECT_EQ(differing(), std::vector<std::string>{"sum_of_shares"});
}

TEST_F(VerifyTest, AnotherHeightIsTold) {
  for (float& height : decoded_.surface.heights) height += 1e-4f;
  EXPECT_FALSE(Verify(&scan_).agrees());
}

TEST_F(VerifyTest, AFileThatStatesNothingIsNotConfirmed) {
  decoded_.metadata = {};
  EXPECT_FALSE(Verify(nullptr).agrees());
  EXPECT_EQ(Verify(&scan_).scan, StatedScan::kUnknown);
}

TEST_F(VerifyTest, AFileWithoutItsLastLayersIsNotConfirmed) {
  EncodedSurface prefix = encoded_;
  const int finest = decoded_.surface.max_level;
  while (decoded_.surface.max_level == finest) {  // the flags may follow the last layer
    prefix.chunks.pop_back();
    decoded_ = DecodeDss(prefix.Concatenate(), RunContext()).value();
  }
  EXPECT_FALSE(Verify(nullptr).complete);
  EXPECT_FALSE(Verify(nullptr).agrees());
}

TEST(CertificateSizeTest, ASizeIsKeptWithTheCertificateInIt) {
  const PointCloud scan = Scan("star", 6000);
  ReconstructOptions options;
  for (int64_t bytes : {2000, 3000, 5000}) {
    options.encode.max_bytes = bytes;
    const auto made = Reconstruct(scan, options, RunContext());
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_LE(made->encoded.Concatenate().size(), static_cast<size_t>(bytes));
    EXPECT_EQ(made->report.encoded_bytes, static_cast<int64_t>(made->encoded.Concatenate().size()));
  }
}

}  // namespace
}  // namespace rilievo
