#include "client/cli/length_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/cli/exit_code.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using Of = Length::Of;

TEST(LengthWordsTest, EachKindIsRead) {
  const std::tuple<const char*, double, Of> cases[] = {
      {"0.001", 0.001, Of::kDiagonal}, {"1e-3", 0.001, Of::kDiagonal},
      {"0.1%", 0.001, Of::kDiagonal},  {"2cm", 0.02, Of::kMetres},
      {"7 cm", 0.07, Of::kMetres},     {"0.5mm", 0.0005, Of::kMetres},
      {"1ft", 0.3048, Of::kMetres},    {"1us-ft", 1200.0 / 3937, Of::kMetres},
      {"3um", 3e-6, Of::kMetres},      {"0.02u", 0.02, Of::kScanUnits},
  };
  for (const auto& [text, value, of] : cases) {
    const auto length = ParseLength(text);
    ASSERT_TRUE(length.ok()) << length.status();
    EXPECT_EQ(length->value, value) << text;
    EXPECT_EQ(length->of, of) << text;
  }
}

TEST(LengthWordsTest, AnythingElseIsRefusedWithTheWaysToWriteIt) {
  for (const char* text : {"", "cm", "2 parsecs", "two", "-1mm", "1mm2", "nan", "inf", "1e400m"}) {
    EXPECT_THAT(std::string(ParseLength(text).status().message()), HasSubstr("2cm")) << text;
  }
  EXPECT_FALSE(ParseLength("0mm").ok());
}

TEST(LengthWordsTest, LengthsBecomeUnitsOfTheScan) {
  const ScanPlace millimetres{0.001, UpDirection::kUnknown, ""};
  EXPECT_EQ(InScanUnits(*ParseLength("2cm"), millimetres, "--max-error", "a.ply").value(), 20);
  EXPECT_EQ(InScanUnits(*ParseLength("2u"), {}, "--max-error", "a.ply").value(), 2);
  const auto refused = InScanUnits(*ParseLength("2cm"), {}, "--max-error", "a.ply");
  EXPECT_EQ(ExitCodeOf(refused.status()), ExitCode::kUsage);
  EXPECT_THAT(std::string(refused.status().message()),
              ::testing::AllOf(HasSubstr("--max-error 2cm"), HasSubstr("a.ply"),
                               HasSubstr("--unit"), HasSubstr("0.02u")));
}

TEST(LengthWordsTest, UnitsHaveNames) {
  for (const std::string& name : UnitNames()) EXPECT_EQ(UnitName(MetresOf(name)), name);
  EXPECT_EQ(UnitName(0), "");
  EXPECT_EQ(UnitName(2.5), "2.5 m");
  EXPECT_EQ(LengthText(0.0125, {0.001, UpDirection::kUnknown, ""}), "0.0125 mm");
  EXPECT_EQ(LengthText(0.0125, {}), "0.0125");
}

}  // namespace
}  // namespace rilievo
