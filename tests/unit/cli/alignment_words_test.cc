// The reasons for which scans are not brought together, in words.
#include "client/cli/alignment_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rilievo {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

// A ring of three scans, each pair of which overlaps and fits.
AlignmentReport Ring() {
  AlignmentReport report;
  report.scans = {"a.ply", "b.ply", "c.ply"};
  report.place.metres_per_unit = 1;
  Alignment& alignment = report.alignment;
  alignment.moves.assign(3, Eigen::Isometry3d::Identity());
  alignment.group = {0, 0, 0};
  alignment.diagonal = 10;
  for (const auto& [first, second] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 2)}) {
    alignment.pairs.push_back({.first = first,
                               .second = second,
                               .overlap = 0.3,
                               .matches = 1000,
                               .rms = 0.01,
                               .spread = 0.01,
                               .explained = 0.01,
                               .overlaps = true,
                               .fits = true});
  }
  return report;
}

std::string ReasonOf(const AlignmentReport& report) {
  const absl::Status status = CheckAlignment(report);
  EXPECT_TRUE(absl::IsFailedPrecondition(status)) << status;
  return std::string(status.message());
}

TEST(AlignmentWordsTest, ALoopThatDoesNotCloseIsSaidToBeOne) {
  AlignmentReport report = Ring();
  EXPECT_TRUE(CheckAlignment(report).ok());
  PairFigures& open = report.alignment.pairs[1];
  open.fits = false;
  open.fits_alone = true;
  open.rms = open.spread = 0.05;
  EXPECT_THAT(
      ReasonOf(report),
      AllOf(HasSubstr("b.ply and c.ply fit alone, but not together with the others"),
            HasSubstr("the loop of scans does not close"),
            HasSubstr("30.0 % overlap, RMS 0.0500 m (0.500 %)"), HasSubstr("leave it out")));
}

TEST(AlignmentWordsTest, APairThatDoesNotFitEvenAloneComesFirst) {
  AlignmentReport report = Ring();
  std::vector<PairFigures>& pairs = report.alignment.pairs;
  pairs[1].fits = pairs[2].fits = false;
  pairs[1].fits_alone = true;
  pairs[1].spread = 0.5;
  pairs[2].spread = 0.05;
  EXPECT_THAT(ReasonOf(report),
              AllOf(HasSubstr("a.ply and c.ply do not fit"), Not(HasSubstr("the loop of scans"))));
}

TEST(AlignmentWordsTest, ScansApartAreNamed) {
  AlignmentReport report = Ring();
  report.alignment.group = {0, 0, 2};
  report.alignment.pairs.resize(2);
  report.alignment.pairs[1].overlaps = report.alignment.pairs[1].fits = false;
  report.alignment.pairs[1].overlap = 0.04;
  EXPECT_THAT(ReasonOf(report), AllOf(HasSubstr("c.ply and a.ply, b.ply do not overlap enough"),
                                      HasSubstr("at most 4.00 % of the points")));
}

}  // namespace
}  // namespace rilievo
