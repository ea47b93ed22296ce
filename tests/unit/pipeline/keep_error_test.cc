#include "core/pipeline/keep_error.h"

#include <gtest/gtest.h>

#include "core/pipeline/certificate.h"
#include "tests/unit/pipeline/prepared_scan.h"

namespace rilievo {
namespace {

struct Made {
  PreparedScan prepared;
  ReconstructOptions options;
  CodedSurface coded;

  Made(double noise, double max_error) : prepared(PrepareScan(*MakeTorus(), 12000, noise)) {
    options.encode.max_error = max_error;
    const Domain domain =
        FitDomain(prepared.scan, prepared.control, options, {}, &prepared.report).value();
    coded = BuildSurface(prepared.scan, domain, {}, options, {}, &prepared.report).value();
  }
  bool Keep() {
    return KeepError(prepared.scan.cloud, options, {}, &prepared.report, &coded).value();
  }
  double Error() const {
    const DecodedSurface decoded = DecodeDss(coded.encoded.Concatenate(), {}).value();
    return MeasureSurface(decoded.surface, PointsToMeasure(prepared.scan.cloud), {})
        .value()
        .across_rms;
  }
};

TEST(KeepErrorTest, TheErrorIsKeptAndNotMuchFinerThanAskedFor) {
  Made made(0, 4e-4);
  EXPECT_TRUE(made.Keep());
  EXPECT_LE(made.Error(), 4e-4);
  EXPECT_GE(made.Error(), 0.9 * 4e-4);
}

// As if the first coding had been far too coarse.
TEST(KeepErrorTest, TooCoarseACodingIsMadeFiner) {
  Made made(0, 4e-4);
  made.coded.encoded =
      RecodeSurface(made.coded, 1.5e-3, made.options, {}, &made.prepared.report).value();
  ASSERT_GT(made.Error(), 4e-4);
  EXPECT_TRUE(made.Keep());
  EXPECT_LE(made.Error(), 4e-4);
}

// Wide errors leave nothing to code; the search must not leave what the coder takes.
TEST(KeepErrorTest, AnErrorOfPercentsIsKeptToo) {
  for (const double wide : {0.01, 0.05, 0.1}) {
    Made made(0, wide);
    const size_t before = made.coded.encoded.Concatenate().size();
    EXPECT_TRUE(made.Keep()) << wide;
    EXPECT_LE(made.Error(), wide);
    EXPECT_LE(made.coded.encoded.Concatenate().size(), before) << wide;
  }
}

TEST(KeepErrorTest, NoiseDoesNotAllowLessThanItself) {
  Made made(1e-3, 8e-4);
  const std::vector<uint8_t> before = made.coded.encoded.Concatenate();
  EXPECT_FALSE(made.Keep());
  EXPECT_EQ(made.coded.encoded.Concatenate(), before);
}

TEST(KeepErrorTest, WithoutAnErrorAskedForThereIsNothingToKeep) {
  Made made(0, 1e-3);
  made.options.encode.max_error.reset();
  const std::vector<uint8_t> before = made.coded.encoded.Concatenate();
  EXPECT_TRUE(made.Keep());
  EXPECT_EQ(made.coded.encoded.Concatenate(), before);
}

}  // namespace
}  // namespace rilievo
