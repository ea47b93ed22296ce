#include "server/conversion/option_reader.h"

#include <gtest/gtest.h>

#include <limits>

namespace rilievo {
namespace {

TEST(Range, KnowsItsEnds) {
  const Range closed{0, 1};
  EXPECT_TRUE(closed.Contains(0));
  EXPECT_TRUE(closed.Contains(1));
  EXPECT_FALSE(closed.Contains(1.0000001));
  const Range open{.low = 0, .high = 1, .low_open = true, .high_open = true};
  EXPECT_FALSE(open.Contains(0));
  EXPECT_FALSE(open.Contains(1));
  EXPECT_TRUE(open.Contains(0.5));
  EXPECT_FALSE(closed.Contains(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_FALSE(closed.Contains(std::numeric_limits<double>::infinity()));
  EXPECT_EQ(open.Text(), "(0, 1)");
  EXPECT_EQ(closed.Text(), "[0, 1]");
}

TEST(OptionReader, KeepsDefaultsAndCollectsViolations) {
  std::vector<FieldViolation> violations;
  OptionReader reader("header.options.fit", &violations);
  int rounds = 4;
  reader.Read("rounds", false, 99, {1, 50}, &rounds);
  EXPECT_EQ(rounds, 4);
  reader.Read("rounds", true, 7, {1, 50}, &rounds);
  EXPECT_EQ(rounds, 7);
  reader.Read("rounds", true, uint32_t{4294967295u}, {1, 50}, &rounds);
  EXPECT_EQ(rounds, 7);
  ASSERT_EQ(violations.size(), 1u);
  EXPECT_EQ(violations[0].field, "header.options.fit.rounds");
  EXPECT_EQ(violations[0].description,
            "4.29497e+09 is outside [1, 50]; give a value in that range, or leave it out for the "
            "default");
}

}  // namespace
}  // namespace rilievo
