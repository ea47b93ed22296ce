#include "client/formats/number_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <clocale>
#include <cmath>
#include <limits>
#include <string>

namespace rilievo {
namespace {

double Parsed(const std::string& token) {
  double value = -12345;
  const absl::Status status = ParseNumber(token, &value);
  EXPECT_TRUE(status.ok()) << status;
  return value;
}

TEST(NumberTextTest, ReadsWhatPeopleWrite) {
  EXPECT_EQ(Parsed("+1e0"), 1);
  EXPECT_EQ(Parsed("-0"), 0);
  EXPECT_TRUE(std::signbit(Parsed("-0")));
  EXPECT_EQ(Parsed(".5"), 0.5);
  EXPECT_EQ(Parsed("5."), 5);
  EXPECT_EQ(Parsed("1E-3"), 1e-3);
  EXPECT_EQ(Parsed("4600000.123456789"), 4600000.123456789);
  EXPECT_EQ(Parsed("1e-400"), 0);
  EXPECT_EQ(Parsed("5e-324"), std::numeric_limits<double>::denorm_min());
  EXPECT_TRUE(std::isnan(Parsed("nan")));
  EXPECT_EQ(Parsed("-inf"), -std::numeric_limits<double>::infinity());
}

TEST(NumberTextTest, RefusesTheRest) {
  double value;
  for (const char* token : {"", "abc", "1e400", "-1e999", "0,5", "1.2.3", "++1", "+-1", "1e",
                            "0x10", "1_000", "--", "1 "}) {
    EXPECT_FALSE(ParseNumber(token, &value).ok()) << token;
  }
  EXPECT_THAT(std::string(ParseNumber("0,5", &value).message()),
              ::testing::HasSubstr("decimal comma"));
}

TEST(NumberTextTest, CountsAreDigitsAlone) {
  uint64_t count = 0;
  EXPECT_TRUE(ParseCount("18446744073709551615", &count));
  EXPECT_EQ(count, std::numeric_limits<uint64_t>::max());
  for (const char* token : {"", "-1", "+1", "1.0", "18446744073709551616", "1x", " 1"}) {
    EXPECT_FALSE(ParseCount(token, &count)) << token;
  }
}

TEST(NumberTextTest, NumbersReadBackTheSame) {
  for (double value : {1.0 / 3, 1e-310, -0.0, 1.7976931348623157e308, 4600000.000000001}) {
    std::string text;
    AppendNumber(value, &text);
    EXPECT_EQ(Parsed(text), value);
  }
  std::string text;
  AppendNumber(0.1f, &text);
  EXPECT_EQ(text, "0.1");
}

TEST(NumberTextTest, QuotesAreShortAndPrintable) {
  EXPECT_EQ(Quoted("a\nb\x01"), "'a?b?'");
  EXPECT_EQ(Quoted(std::string(50, 'x')), "'" + std::string(40, 'x') + "...'");
}

}  // namespace
}  // namespace rilievo
