#include "core/pipeline/report_warnings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rilievo {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

ReconstructReport Good() {
  ReconstructReport report;
  report.surface_vertices = 1000;
  report.heights_measured = 990;
  report.heights_filled = 10;
  report.median_spacing = 0.004;
  report.median_noise = 0.0004;
  report.error.b_to_a.rms = 0.002;
  return report;
}

TEST(WarningsTest, AGoodReconstructionHasNone) { EXPECT_THAT(WarningsOf(Good()), IsEmpty()); }

TEST(WarningsTest, EachFaultHasASentence) {
  ReconstructReport report = Good();
  report.error.b_to_a.rms = 0.02;
  report.normal_disagreement = 0.3;
  report.heights_filled = 500;
  report.median_noise = 0.01;
  report.border_miss = 3e-5;
  report.strays = 2;
  report.non_finite = 7;
  EXPECT_THAT(WarningsOf(report),
              ElementsAre(HasSubstr("5.0 of their spacings"), HasSubstr("30 %"), HasSubstr("50 %"),
                          HasSubstr("1.00 %"), HasSubstr("up to 0.0030 %"), HasSubstr("2 point(s)"),
                          HasSubstr("7 point(s)")));
}

TEST(WarningsTest, PointsThatNoiseKeepsOffTheSurfaceAreNoPoorFit) {
  ReconstructReport report = Good();
  report.error.b_to_a.rms = 0.02;
  report.median_noise = 0.019;
  EXPECT_THAT(WarningsOf(report), ElementsAre(HasSubstr("1.90 %")));
}

TEST(WarningsTest, BordersThatWereToBeClosedAndStayOpenAreNamed) {
  ReconstructReport report = Good();
  report.topology = "planar";
  report.boundary_loops = 1;
  EXPECT_THAT(WarningsOf(report), IsEmpty());
  report.close_asked = true;
  EXPECT_THAT(WarningsOf(report), ElementsAre(AllOf(HasSubstr("1 border(s) stay open"),
                                                    HasSubstr("outer border of its sheet"))));
}

ReconstructReport NotKept() {
  ReconstructReport report = Good();
  report.max_error = 3e-4;
  report.error_unreachable = true;
  report.error.across_rms = 5e-4;
  report.uncoded_error = 4e-4;
  report.error.b_to_a.rms = 5e-4;
  return report;
}

TEST(WarningsTest, AnErrorThatIsNotKeptIsNamedWithItsReason) {
  const ReconstructReport noisy = NotKept();
  EXPECT_THAT(WarningsOf(noisy),
              ElementsAre(AllOf(HasSubstr("0.0300 %"),
                                HasSubstr("0.0500 % is reached, and 0.0400 % before coding"),
                                HasSubstr("scatter by 0.0400 %"))));
  ReconstructReport holes = NotKept();
  holes.median_noise = 1e-5;
  holes.error.across_rms = 2e-3;
  EXPECT_THAT(WarningsOf(holes), ElementsAre(AllOf(HasSubstr("0.2000 % is reached"),
                                                   HasSubstr("1.0 % of its heights are filled"))));
  ReconstructReport coarse = NotKept();
  coarse.median_noise = 1e-5;
  EXPECT_THAT(WarningsOf(coarse), ElementsAre(HasSubstr("0.400 % apart")));
}

}  // namespace
}  // namespace rilievo
