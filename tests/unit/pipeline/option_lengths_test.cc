#include "core/pipeline/option_lengths.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/scans/analytic_shape.h"
#include "tests/scans/scanner.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

TEST(OptionLengthsTest, BecomeFractionsOfTheDiagonal) {
  ReconstructOptions options;
  options.lengths.max_error = 0.02;
  const auto with_error = WithoutLengths(options, 80);
  ASSERT_TRUE(with_error.ok()) << with_error.status();
  EXPECT_EQ(with_error->encode.max_error, 0.02 / 80);
  EXPECT_FALSE(with_error->lengths.max_error);
  options.lengths = {};
  options.lengths.height_step = 0.001;
  EXPECT_EQ(WithoutLengths(options, 80)->encode.height_step, 0.001 / 80);
  options.lengths = {};
  options.lengths.close_holes_below = 20;
  EXPECT_EQ(WithoutLengths(options, 80)->control.close_holes_below, 0.25);
}

TEST(OptionLengthsTest, OutOfRangeSaysWhatIsPossible) {
  ReconstructOptions options;
  for (const double length : {9.0, 1e-5}) {
    options.lengths.max_error = length;
    const auto refused = WithoutLengths(options, 80);
    EXPECT_EQ(refused.status().code(), absl::StatusCode::kInvalidArgument);
    EXPECT_THAT(std::string(refused.status().message()),
                ::testing::AllOf(HasSubstr("max_error"), HasSubstr("between 8e-05 and 8 ")));
  }
}

TEST(OptionLengthsTest, AreCheckedBeforeAnythingIsDone) {
  ReconstructOptions options;
  for (const double length : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
    options.lengths.max_error = length;
    EXPECT_FALSE(options.Validate().ok());
  }
  options.lengths.max_error = 1;
  EXPECT_TRUE(options.Validate().ok());
  options.encode.max_bytes = 1000;
  EXPECT_FALSE(options.Validate().ok());
  options.encode = {};
  options.encode.max_error = 0.01;
  EXPECT_FALSE(options.Validate().ok());
}

TEST(OptionLengthsTest, TheBytesAreThoseOfTheFractionAndThePlaceIsInThem) {
  ScannerOptions scanner;
  scanner.points = 3000;
  const PointCloud cloud = SimulateScan(*MakeTorus(), scanner)->cloud;
  ReconstructOptions options;
  options.place = {0.001, UpDirection::kY, "EPSG:25832"};
  options.lengths.max_error = 0.004;
  const auto by_length = Reconstruct(cloud, options, {});
  ASSERT_TRUE(by_length.ok()) << by_length.status();
  options.lengths = {};
  options.encode.max_error = 0.004 / by_length->surface.frame.diagonal;
  const auto by_fraction = Reconstruct(cloud, options, {});
  ASSERT_TRUE(by_fraction.ok()) << by_fraction.status();
  EXPECT_EQ(by_length->encoded.Concatenate(), by_fraction->encoded.Concatenate());
  EXPECT_EQ(by_length->report.place, options.place);
  EXPECT_EQ(DecodeDss(by_length->encoded.Concatenate(), {})->metadata.place, options.place);
}

}  // namespace
}  // namespace rilievo
