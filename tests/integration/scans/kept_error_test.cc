// An error or a size asked for, on real scans: kept as the certificate says, and verify agrees.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "client/formats/scan_reader.h"
#include "core/pipeline/certificate.h"
#include "core/pipeline/reconstruct.h"
#include "tests/scans/shared_folder.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

struct Asked {
  const char* name;
  double max_error;
  bool reachable;
};

void PrintTo(const Asked& asked, std::ostream* out) { *out << asked.name << asked.max_error; }

class KeptTest : public testing::Test {
 protected:
  void Read(const std::string& name) {
    const auto path = SharedData() / (name + ".ply");
    if (!std::filesystem::exists(path)) {
      GTEST_SKIP() << "the shared scans are not on this machine";
    }
    auto scan = ReadScan(path.string());
    ASSERT_TRUE(scan.ok()) << scan.status();
    cloud_ = std::move(scan->cloud);
  }

  // What verify finds in the bytes: the error that max_error is about. -1 if it does not agree.
  double VerifiedError(const std::vector<uint8_t>& bytes) {
    const auto decoded = DecodeDss(bytes, {});
    EXPECT_TRUE(decoded.ok()) << decoded.status();
    if (!decoded.ok()) return -1;
    const auto verified = VerifyCertificate(*decoded, &cloud_, {});
    EXPECT_TRUE(verified.ok()) << verified.status();
    if (!verified.ok() || !verified->agrees()) return -1;
    for (const CertifiedFigure& figure : verified->figures) {
      if (figure.name == "rms_across") return figure.found;
    }
    return -1;
  }

  PointCloud cloud_;
};

class KeptErrorTest : public KeptTest, public testing::WithParamInterface<Asked> {
 protected:
  void SetUp() override { Read(GetParam().name); }
};

class KeptSizeTest : public KeptTest, public testing::WithParamInterface<std::string> {
 protected:
  void SetUp() override { Read(GetParam()); }
};

TEST_P(KeptErrorTest, IsKeptOrSaidNotToBe) {
  ReconstructOptions options;
  options.encode.max_error = GetParam().max_error;
  const auto result = Reconstruct(cloud_, options, {});
  ASSERT_TRUE(result.ok()) << result.status();
  const double found = VerifiedError(result->encoded.Concatenate());
  ASSERT_GT(found, 0);
  EXPECT_EQ(result->report.error_unreachable, !GetParam().reachable);
  if (GetParam().reachable) {
    EXPECT_LE(found, GetParam().max_error);
    return;
  }
  EXPECT_GT(found, GetParam().max_error);
  ASSERT_FALSE(result->report.warnings.empty());
  EXPECT_THAT(result->report.warnings[0], HasSubstr("is not kept"));
}

TEST_P(KeptSizeTest, ASizeIsKept) {
  ReconstructOptions options;
  options.encode.max_bytes = 4000;
  const auto result = Reconstruct(cloud_, options, {});
  ASSERT_TRUE(result.ok()) << result.status();
  const std::vector<uint8_t> bytes = result->encoded.Concatenate();
  EXPECT_LE(bytes.size(), 4000u);
  EXPECT_GT(bytes.size(), 3200u);
  EXPECT_GT(VerifiedError(bytes), 0);
}

INSTANTIATE_TEST_SUITE_P(Shared, KeptErrorTest,
                         testing::Values(Asked{"tum_rabbit", 1e-3, true},
                                         Asked{"mechpart_genus3", 1e-3, true},
                                         Asked{"distcap", 1e-3, false}),
                         [](const auto& test) {
                           return std::string(test.param.name) +
                                  (test.param.reachable ? "_reachable" : "_not");
                         });
INSTANTIATE_TEST_SUITE_P(Shared, KeptSizeTest, testing::Values("tum_rabbit", "distcap"),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace rilievo
