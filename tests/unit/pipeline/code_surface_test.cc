#include "core/pipeline/code_surface.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/pipeline/certificate.h"
#include "tests/unit/pipeline/prepared_scan.h"

namespace rilievo {
namespace {

UncodedError Uncoded(double rms, double p95, double noise, bool measured = true) {
  UncodedError uncoded{
      .spacing = 0.004, .noise = noise, .leverage = 1.0 / 16, .measured = measured, .error = {}};
  uncoded.error.b_to_a.rms = rms;
  uncoded.error.b_to_a.p95 = p95;
  return uncoded;
}

TEST(CodingErrorTest, OnACleanScanAShareOfTheDistanceOfItsPoints) {
  EXPECT_NEAR(CodingError(Uncoded(1e-4, 3e-4, 0)), 3e-5, 1e-12);
}

TEST(CodingErrorTest, StraysDoNotCoarsenTheRest) {
  EXPECT_NEAR(CodingError(Uncoded(5e-3, 2e-4, 0)), 3e-5, 1e-12);
}

// Points 0.1 % off the surface whose noise is 0.1 %: what is left of it in the surface counts.
TEST(CodingErrorTest, NoiseIsNotTheErrorOfTheSurface) {
  EXPECT_NEAR(CodingError(Uncoded(1e-3, 2e-3, 1e-3)), 7.5e-5, 1e-12);
  // An eightieth of the spacing at least.
  EXPECT_NEAR(CodingError(Uncoded(1e-4, 2e-4, 1e-4)), 1.5e-5, 1e-12);
}

TEST(CodingErrorTest, WhatIsAskedForIsSharedWithTheSurfacesOwnError) {
  const UncodedError uncoded = Uncoded(3e-4, 1e-3, 0);
  // Aimed 4 % below: 4.8^2 = 3^2 + 3.747^2.
  EXPECT_NEAR(CodingErrorWithin(5e-4, uncoded), 3.747e-4, 1e-7);
  EXPECT_EQ(CodingErrorWithin(2e-4, uncoded), CodingError(uncoded));
}

// Measured both ways, as the certificate has it: 4.925^2 = 3^2 + 3.906^2.
TEST(CodingErrorTest, WhatIsMeasuredIsKeptAsMeasured) {
  UncodedError uncoded = Uncoded(2e-4, 1e-3, 0);
  uncoded.error.across_rms = 3e-4;
  EXPECT_NEAR(CodingErrorWithin(5e-4, uncoded), 3.906e-4, 1e-7);
  // Little room: half of what there is.
  uncoded.error.across_rms = 4.99e-4;
  EXPECT_NEAR(CodingErrorWithin(5e-4, uncoded), 0.158e-4, 1e-7);
  // None: as meant against the truth.
  uncoded.error.across_rms = 6e-4;
  EXPECT_NEAR(CodingErrorWithin(5e-4, uncoded), 4.36e-4, 1e-6);
}

TEST(CodingErrorTest, NoiseAllowsWhatLeavesTheSurfaceHalfOfIt) {
  EXPECT_FALSE(NoiseAllows(1.1e-3, 1e-3));
  EXPECT_TRUE(NoiseAllows(1.2e-3, 1e-3));
  EXPECT_TRUE(NoiseAllows(1e-6, 0));
}

TEST(CodingErrorTest, BetweenItsPointsAnySurfaceIsOff) {
  EXPECT_NEAR(CodingError(Uncoded(0, 0, 0, false)), 1.5e-5, 1e-12);
  EXPECT_NEAR(CodingError(Uncoded(0, 0, 0)), 1.5e-5, 1e-12);
}

TEST(CodeSurfaceTest, TheFileHoldsTheSurfaceOverTheRoundedDomain) {
  const PreparedScan prepared = PrepareScan(*MakeTorus(), 10000, 0);
  ReconstructOptions options;
  options.encode.position_step = 1e-3;
  const Domain domain = FitDomain(prepared.scan, prepared.control.mesh, options, {}).value();
  EXPECT_EQ(domain.position_step, 1e-3);
  EXPECT_EQ(domain.fit.control_mesh.faces.cols(), prepared.control.mesh.faces.cols());
  const CodedSurface coded = SampleAndCode(prepared, domain, options).value();
  const ControlMesh& mesh = coded.surface.control_mesh;
  const double off = mesh.vertices(0, 0) / 1e-3;
  EXPECT_NEAR(off, std::round(off), 0.2);  // the stored step has 12 binary digits
  const DecodedSurface decoded = DecodeDss(coded.encoded.Concatenate(), {}).value();
  EXPECT_EQ(decoded.surface.control_mesh.vertices, mesh.vertices);
  EXPECT_EQ(decoded.surface.heights.size(), coded.surface.heights.size());
  EXPECT_LT(coded.uncoded.error.b_to_a.rms, 1e-3);
}

TEST(CodeSurfaceTest, ADomainIsRoundedToAnotherStepFromWhatWasFitted) {
  const PreparedScan prepared = PrepareScan(*MakeTorus(), 10000, 0);
  Domain domain = FitDomain(prepared.scan, prepared.control.mesh, {}, {}).value();
  const auto vertices = [&](double step) -> Eigen::Matrix3Xd {
    domain.position_step = step;
    return SampleAndCode(prepared, domain, {})->surface.control_mesh.vertices;
  };
  const Eigen::Matrix3Xd fine = vertices(1e-3), coarse = vertices(4e-3);
  EXPECT_LE((coarse - fine).cwiseAbs().maxCoeff(), 2.51e-3);
  EXPECT_EQ(vertices(1e-3), fine);
}

TEST(CodeSurfaceTest, ASizeBelowTheControlMeshIsRefused) {
  const PreparedScan prepared = PrepareScan(*MakeTorus(), 10000, 0);
  ReconstructOptions options;
  options.encode.max_bytes = 100;
  const Domain domain = FitDomain(prepared.scan, prepared.control.mesh, options, {}).value();
  EXPECT_TRUE(absl::IsResourceExhausted(SampleAndCode(prepared, domain, options).status()));
}

struct Made {
  PreparedScan prepared;
  ReconstructOptions options;
  CodedSurface coded;

  Made(double noise, double max_error) : prepared(PrepareScan(*MakeTorus(), 12000, noise)) {
    options.encode.max_error = max_error;
    Domain domain = FitDomain(prepared.scan, prepared.control.mesh, options, {}).value();
    coded = SampleAndCode(prepared, std::move(domain), options).value();
  }
  bool Keep() {
    coded = KeepError(prepared.scan.cloud, {}, std::move(coded), options, {}).value();
    return coded.keeps_error;
  }
  double Error() const {
    const DecodedSurface decoded = DecodeDss(coded.encoded.Concatenate(), {}).value();
    return MeasureSurface(decoded.surface, {}, PointsToMeasure(prepared.scan.cloud), {})
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

TEST(KeepErrorTest, TooCoarseACodingIsMadeFiner) {
  Made made(0, 1.6e-3);
  made.options.encode.max_error = 4e-4;
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
