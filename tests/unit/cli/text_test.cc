// The small parts of the command line: layout, exit codes, progress, report.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <thread>

#include "client/cli/exit_code.h"
#include "client/cli/progress_display.h"
#include "client/cli/report_output.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

size_t WidestLine(const std::string& text) {
  std::istringstream lines(text);
  size_t widest = 0;
  for (std::string line; std::getline(lines, line);) widest = std::max(widest, line.size());
  return widest;
}

TEST(TextLayoutTest, WrapsAtBlanksAndKeepsEveryWord) {
  std::string text;
  for (int i = 0; i < 100; ++i) text += "word" + std::to_string(i) + " ";
  const std::string wrapped = Wrap(text, 4);
  EXPECT_LE(WidestLine(wrapped), 80u);
  std::istringstream before(text), after(wrapped);
  for (std::string a, b; before >> a;) {
    ASSERT_TRUE(after >> b);
    EXPECT_EQ(a, b);
  }
  EXPECT_EQ(Wrap("one two", 2, 5), "one\n  two");
  EXPECT_EQ(Wrap("a\nb", 2), "a\n  b");
  EXPECT_EQ(Wrap("", 2), "");
  EXPECT_EQ(Wrap(std::string(100, 'x'), 2), std::string(100, 'x'));
}

TEST(TextLayoutTest, LabelledLinesStandInColumns) {
  EXPECT_EQ(LabelledLine("size", "12 bytes"), "  size        12 bytes\n");
  const std::string line =
      LabelledLine("topology", std::string(60, 'a') + " " + std::string(30, 'b'));
  EXPECT_EQ(line, "  topology    " + std::string(60, 'a') + "\n              " +
                      std::string(30, 'b') + "\n");
}

TEST(TextLayoutTest, Numbers) {
  EXPECT_EQ(Grouped(0), "0");
  EXPECT_EQ(Grouped(999), "999");
  EXPECT_EQ(Grouped(1234567), "1,234,567");
  EXPECT_EQ(Grouped(-123456), "-123,456");
  EXPECT_EQ(Counted(1, "face", "faces"), "1 face");
  EXPECT_EQ(Counted(2000, "face", "faces"), "2,000 faces");
  EXPECT_EQ(Short(0), "0");
  EXPECT_EQ(Short(0.000123456), "0.000123");
  EXPECT_EQ(Short(1234.5), "1234");
  EXPECT_EQ(Short(3.14159), "3.14");
  EXPECT_EQ(Short(1e-9), "1.00e-09");
  EXPECT_EQ(Percent(0.5), "50.0 %");
  EXPECT_EQ(Percent(0), "0 %");
  EXPECT_NE(Percent(1e-8), "0 %");
}

TEST(ExitCodeTest, FollowsTheStatusUnlessOneIsAttached) {
  EXPECT_EQ(ExitCodeOf(absl::OkStatus()), ExitCode::kOk);
  EXPECT_EQ(ExitCodeOf(absl::InvalidArgumentError("")), ExitCode::kInput);
  EXPECT_EQ(ExitCodeOf(absl::DataLossError("")), ExitCode::kInput);
  EXPECT_EQ(ExitCodeOf(absl::UnavailableError("")), ExitCode::kServer);
  EXPECT_EQ(ExitCodeOf(absl::CancelledError("")), ExitCode::kCancelled);
  EXPECT_EQ(ExitCodeOf(absl::InternalError("")), ExitCode::kInternal);
  EXPECT_EQ(ExitCodeOf(WithExitCode(absl::NotFoundError(""), ExitCode::kOutput)),
            ExitCode::kOutput);
  EXPECT_TRUE(WithExitCode(absl::OkStatus(), ExitCode::kOutput).ok());
}

TEST(ProgressDisplayTest, BarsFitTheTerminalAndAreWipedAtTheEnd) {
  std::ostringstream out;
  {
    ProgressDisplay display(ProgressDisplay::Style::kBar, out);
    display.Update(3, 8, "a-name-that-is-far-too-long-for-the-line", 0.5);
    display.Update(4, 8, "next", std::nan(""));
    display.Finish();
  }
  std::string line, widest;
  std::istringstream drawn(out.str());
  while (std::getline(drawn, line, '\r')) {
    EXPECT_LT(line.size(), 80u);
    if (line.size() > widest.size()) widest = line;
  }
  EXPECT_THAT(widest, HasSubstr("[3/8]"));
  EXPECT_THAT(widest, HasSubstr("50 %"));
  EXPECT_EQ(out.str().back(), '\r');
  EXPECT_EQ(out.str().find('\n'), std::string::npos);
}

TEST(ProgressDisplayTest, LinesTellEachStepOnce) {
  std::ostringstream out;
  ProgressDisplay display(ProgressDisplay::Style::kLines, out);
  for (const char* step : {"one", "two"}) {
    display.Update(1, 2, step, 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    display.Update(1, 2, step, 1);
  }
  display.Finish();
  EXPECT_THAT(out.str(), ::testing::MatchesRegex("\\[1/2\\] one .* s\n\\[1/2\\] two .* s\n"));
  EXPECT_EQ(out.str().find('\r'), std::string::npos);
}

v1::ReconstructReport Report() {
  v1::ReconstructReport report;
  report.set_points_in(123456);
  report.set_outliers(17);
  report.set_diagonal(2.5);
  report.set_road("arbitrary");
  report.set_road_reason("the cloud is closed and has holes that neither a plane nor a sphere has");
  report.set_components(1);
  report.set_genus(2);
  report.set_control_faces(2048);
  report.set_max_level(4);
  report.set_surface_faces(524288);
  report.set_heights_measured(990);
  report.set_heights_filled(10);
  report.mutable_error()->set_rms(0.0002);
  report.mutable_error()->mutable_points_to_surface()->set_rms(0.0002);
  report.mutable_error()->set_max(0.004);
  report.set_encoded_bytes(34567);
  for (int stage = v1::STAGE_CHECK; stage <= v1::STAGE_MEASURE; ++stage) {
    v1::StageTime* time = report.add_stage_times();
    time->set_stage(static_cast<v1::Stage>(stage));
    time->set_seconds(0.25);
  }
  report.set_total_seconds(2);
  report.add_warnings(
      "1 % of the surface had no data and was filled in smoothly; look at the orange "
      "parts of 'rilievo view --colors flags'.");
  return report;
}

TEST(ReportOutputTest, TextFitsTheTerminalAndSaysIt) {
  const std::string text = ReportText(Report(), {"scan.ply", "PLY ascii", "out.dss"});
  EXPECT_LE(WidestLine(text), 80u);
  EXPECT_THAT(text, HasSubstr("error       scan to surface: RMS 0.000500 (0.0200 %)"));
  v1::ReconstructReport in_metres = Report();
  in_metres.mutable_place()->set_metres_per_unit(0.001);
  EXPECT_THAT(ReportText(in_metres, {}), HasSubstr("RMS 0.000500 mm (0.0200 %)"));
  EXPECT_THAT(ReportLine(in_metres, {}), HasSubstr("scan to surface RMS 0.000500 mm (0.0200"));
  for (const char* part : {"out.dss", "123,456 points", "17 outlying", "genus 2", "closed",
                           "99.0 % measured", "1.00 % filled in", "RMS 0.000500 (0.0200 %)",
                           "34,567 bytes", "2.00 s", "domain-fit 0.25", "warning"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

TEST(ReportOutputTest, JsonHoldsTheReport) {
  const auto json =
      nlohmann::json::parse(ReportJson(Report(), {"scan \"1\"\xff.ply", "PLY", "out.dss"}));
  EXPECT_EQ(json["points_in"], 123456);
  EXPECT_EQ(json["genus"], 2);
  EXPECT_EQ(json["error"]["rms"], 0.0002);
  EXPECT_EQ(json["error"]["scan_to_surface"]["rms"], 0.0005);
  EXPECT_EQ(json["error"]["scan_to_surface"]["rms_ratio"], 0.0002);
  EXPECT_TRUE(json["error"]["scan_to_surface"]["unit"].is_null());
  EXPECT_EQ(json["stage_seconds"]["control-mesh"], 0.25);
  EXPECT_EQ(json["warnings"].size(), 1u);
  v1::ReconstructReport unmeasured = Report();
  unmeasured.clear_error();
  EXPECT_TRUE(nlohmann::json::parse(ReportJson(unmeasured, {}))["error"].is_null());
}

}  // namespace
}  // namespace rilievo
