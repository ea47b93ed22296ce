#include "server/observability/trace_parent.h"

#include <gtest/gtest.h>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

constexpr char kHeader[] = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

TEST(TraceParent, ReadsTheExampleOfTheStandard) {
  const auto parent = ParseTraceParent(kHeader);
  ASSERT_TRUE(parent.has_value());
  EXPECT_EQ(parent->trace_id, "4bf92f3577b34da6a3ce929d0e0e4736");
  EXPECT_EQ(parent->parent_id, "00f067aa0ba902b7");
}

TEST(TraceParent, LaterVersionsMaySayMore) {
  const std::string later = absl::StrCat("cc", std::string(kHeader).substr(2));
  EXPECT_TRUE(ParseTraceParent(later).has_value());
  EXPECT_TRUE(ParseTraceParent(later + "-what-comes").has_value());
  EXPECT_FALSE(ParseTraceParent(later + ".what").has_value());
  EXPECT_FALSE(ParseTraceParent(absl::StrCat(kHeader, "-x")).has_value());
}

TEST(TraceParent, EverythingElseIsNone) {
  const std::string good = kHeader;
  for (size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = bad[i] == '-' ? '0' : 'G';
    EXPECT_FALSE(ParseTraceParent(bad).has_value()) << bad;
    EXPECT_FALSE(ParseTraceParent(good.substr(0, i)).has_value());
  }
  EXPECT_FALSE(ParseTraceParent("ff" + good.substr(2)).has_value());
  EXPECT_FALSE(
      ParseTraceParent("00-00000000000000000000000000000000-00f067aa0ba902b7-01").has_value());
  EXPECT_FALSE(
      ParseTraceParent("00-4bf92f3577b34da6a3ce929d0e0e4736-0000000000000000-01").has_value());
}

}  // namespace
}  // namespace rilievo
