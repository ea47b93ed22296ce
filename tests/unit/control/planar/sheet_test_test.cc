#include "core/control/planar/sheet_test.h"

#include <gtest/gtest.h>

#include <vector>

namespace rilievo {
namespace {

TEST(HasTwoSheets, NeedsAGapWithSheetsOnBothSides) {
  const std::vector<double> slope = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9};
  EXPECT_FALSE(HasTwoSheets(slope, 1.5));
  EXPECT_TRUE(HasTwoSheets(slope, 0.5));
  const std::vector<double> stray = {0, 0.1, 0.2, 0.3, 0.4, 9};
  EXPECT_FALSE(HasTwoSheets(stray, 1));
  const std::vector<double> two = {0, 0.1, 0.2, 0.3, 9, 9.1};
  EXPECT_TRUE(HasTwoSheets(two, 1));
  EXPECT_FALSE(HasTwoSheets(two, 10));
  EXPECT_FALSE(HasTwoSheets({}, 1));
  const std::vector<double> three = {0, 5, 10};
  EXPECT_FALSE(HasTwoSheets(three, 1));
}

TEST(HasTwoSheets, AFewOfManyAreNoSheet) {
  std::vector<double> values(100, 0.0);
  for (size_t i = 95; i < 100; ++i) values[i] = 7;
  EXPECT_FALSE(HasTwoSheets(values, 1));
  for (size_t i = 88; i < 100; ++i) values[i] = 7;
  EXPECT_TRUE(HasTwoSheets(values, 1));
}

}  // namespace
}  // namespace rilievo
