#include "core/pipeline/coding_error.h"

#include <gtest/gtest.h>

namespace rilievo {
namespace {

ReconstructReport Report(double rms, double p95, double noise) {
  ReconstructReport report;
  report.median_spacing = 0.004;
  report.median_noise = noise;
  report.error.b_to_a.rms = rms;
  report.error.b_to_a.p95 = p95;
  return report;
}

TEST(CodingErrorTest, OnACleanScanAShareOfTheDistanceOfItsPoints) {
  EXPECT_NEAR(CodingError(Report(1e-4, 3e-4, 0), true), 3e-5, 1e-12);
}

TEST(CodingErrorTest, StraysDoNotCoarsenTheRest) {
  EXPECT_NEAR(CodingError(Report(5e-3, 2e-4, 0), true), 3e-5, 1e-12);
}

// Points 0.1 % off the surface whose noise is 0.1 %: what is left of it in the surface counts.
TEST(CodingErrorTest, NoiseIsNotTheErrorOfTheSurface) {
  EXPECT_NEAR(CodingError(Report(1e-3, 2e-3, 1e-3), true), 7.5e-5, 1e-12);
}

TEST(CodingErrorTest, WhatIsAskedForIsSharedWithTheSurfacesOwnError) {
  const ReconstructReport report = Report(3e-4, 1e-3, 0);
  // Aimed 4 % below: 4.8^2 = 3^2 + 3.747^2.
  EXPECT_NEAR(CodingErrorWithin(5e-4, report, true), 3.747e-4, 1e-7);
  EXPECT_EQ(CodingErrorWithin(2e-4, report, true), CodingError(report, true));
}

// Measured both ways, as the certificate has it: 4.925^2 = 3^2 + 3.906^2.
TEST(CodingErrorTest, WhatIsMeasuredIsKeptAsMeasured) {
  ReconstructReport report = Report(2e-4, 1e-3, 0);
  report.error.across_rms = 3e-4;
  EXPECT_NEAR(CodingErrorWithin(5e-4, report, true), 3.906e-4, 1e-7);
  // Little room: half of what there is.
  report.error.across_rms = 4.99e-4;
  EXPECT_NEAR(CodingErrorWithin(5e-4, report, true), 0.158e-4, 1e-7);
  // None: as meant against the truth.
  report.error.across_rms = 6e-4;
  EXPECT_NEAR(CodingErrorWithin(5e-4, report, true), 4.36e-4, 1e-6);
}

TEST(CodingErrorTest, NoiseAllowsWhatLeavesTheSurfaceHalfOfIt) {
  EXPECT_FALSE(NoiseAllows(1.1e-3, Report(0, 0, 1e-3)));
  EXPECT_TRUE(NoiseAllows(1.2e-3, Report(0, 0, 1e-3)));
  EXPECT_TRUE(NoiseAllows(1e-6, Report(0, 0, 0)));
}

TEST(CodingErrorTest, BetweenItsPointsAnySurfaceIsOff) {
  EXPECT_NEAR(CodingError(Report(0, 0, 0), false), 1.5e-5, 1e-12);
  EXPECT_NEAR(CodingError(Report(0, 0, 0), true), 1.5e-5, 1e-12);
}

}  // namespace
}  // namespace rilievo
