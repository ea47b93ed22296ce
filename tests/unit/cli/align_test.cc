// Several scans into one: rilievo align, and reconstruct --merge.
#include <string>
#include <vector>

#include "client/formats/scan_reader.h"
#include "client/formats/scan_writer.h"
#include "tests/scans/displaced_views.h"
#include "tests/scans/scanner.h"
#include "tests/unit/cli/program_fixture.h"
#include "tests/unit/formats/e57_file.h"

namespace rilievo {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

// Without the breaks of its lines.
std::string Unwrapped(std::string text) {
  for (size_t at = 0; (at = text.find("\n  ", at)) != std::string::npos;) text.replace(at, 3, " ");
  return text;
}

class AlignTest : public ProgramFixture {
 protected:
  // Five views of a star, each off its place, with noise: view_1.ply and so on.
  std::vector<std::string> SimulateViews() const {
    EXPECT_EQ(Run({"simulate", "star", "-o", At("views/"), "--views", "5", "--points", "30000",
                   "--noise", "0.001", "--displaced"})
                  .code,
              0);
    std::vector<std::string> paths;
    for (int view = 1; view <= 5; ++view) {
      paths.push_back(At("views/view_" + std::to_string(view) + ".ply"));
    }
    return paths;
  }

  // Three views of a ball that have nothing in common.
  std::vector<std::string> SimulateApart() const {
    const SimulatedScan scan =
        SimulateScan(**MakeShape("sphere"),
                     {.points = 20'000, .views = 3, .max_incidence_degrees = 45})
            .value();
    std::vector<std::string> paths;
    for (const DisplacedView& view : DisplaceViews(scan, {})) {
      paths.push_back(At("apart_" + std::to_string(paths.size()) + ".ply"));
      EXPECT_TRUE(WritePlyScan(paths.back(), view.cloud, {}).ok());
    }
    return paths;
  }

  Ended RunOn(std::vector<std::string> words, const std::vector<std::string>& scans,
              const std::vector<std::string>& more) const {
    words.insert(words.end(), scans.begin(), scans.end());
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  }

  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(At(name), std::ios::binary) << bytes;
  }
};

TEST_F(AlignTest, ViewsComeTogetherAndSayHowWell) {
  const std::vector<std::string> views = SimulateViews();
  const Ended ended = RunOn({"align"}, views, {"--json", "-o", At("aligned/")});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const Json json = Json::parse(ended.out);
  EXPECT_EQ(json["aligned"], true);
  ASSERT_EQ(json["scans"].size(), 5u);
  EXPECT_EQ(json["scans"][0]["turn_degrees"], 0);
  EXPECT_EQ(json["scans"][0]["move"][3], Json({0.0, 0.0, 0.0, 1.0}));
  EXPECT_GT(json["pairs"].size(), 3u);
  for (const Json& pair : json["pairs"]) {
    EXPECT_LT(pair["rms_ratio"], 0.002) << pair;
  }
  // What was written is aligned: it has nowhere to go.
  const std::vector<std::string> aligned = {At("aligned/view_1.ply"), At("aligned/view_2.ply"),
                                            At("aligned/view_5.ply")};
  const Json again = Json::parse(RunOn({"align"}, aligned, {"--json"}).out);
  for (const Json& scan : again["scans"]) EXPECT_LT(scan["turn_degrees"], 0.3) << scan;
}

TEST_F(AlignTest, OneFileOfAllKeepsTheirStations) {
  const std::vector<std::string> views = SimulateViews();
  const Ended ended = RunOn({"align"}, views, {"-o", At("all.ply")});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(Unwrapped(ended.out),
              AllOf(HasSubstr("% overlap"), HasSubstr("pairs of points, RMS")));
  EXPECT_LE(WidestLine(ended.out), 80 + At("views/view_1.ply").size());
  const ScanFile all = ReadScan(At("all.ply"), {.stations = true}).value();
  EXPECT_EQ(all.cloud.points.cols(), 30'000);
  EXPECT_EQ(all.cloud.sights.stations.cols(), 5);
}

TEST_F(AlignTest, AMergedScanIsOneClosedSheet) {
  const std::vector<std::string> views = SimulateViews();
  const Ended ended =
      RunOn({"reconstruct"}, views,
            {"--merge", "--align", "-o", At("a.dss"), "--keep-scan", At("all.ply"), "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const Json report = Json::parse(ended.out);
  EXPECT_EQ(report["merged"].size(), 5u);
  EXPECT_EQ(report["alignment"]["aligned"], true);
  EXPECT_EQ(report["points_in"], 30'000);
  EXPECT_EQ(report["components"], 1);
  EXPECT_EQ(report["genus"], 0);
  EXPECT_EQ(report["boundary_loops"], 0);
  EXPECT_LT(report["error"]["scan_to_surface"]["rms_ratio"], 0.0015);
  EXPECT_EQ(Run({"verify", At("a.dss"), At("all.ply")}).code, 0);
}

TEST_F(AlignTest, ViewsThatDoNotOverlapAreRefusedWithTheReason) {
  const std::vector<std::string> views = SimulateApart();
  const Ended ended = RunOn({"align"}, views, {"-o", At("all.ply"), "--json"});
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(Unwrapped(ended.err),
              AllOf(HasSubstr("do not overlap enough"), HasSubstr("apart_1.ply")));
  EXPECT_EQ(Json::parse(ended.out)["aligned"], false);
  EXPECT_FALSE(fs::exists(At("all.ply")));
  const Ended merged = RunOn({"reconstruct"}, views, {"--merge", "--align", "-o", At("a.dss")});
  EXPECT_EQ(merged.code, 3);
  EXPECT_THAT(Unwrapped(merged.err), HasSubstr("do not overlap enough"));
}

// A square of points at `height`, as E57 (in metres) or as text.
std::string SquareE57(double height) {
  std::vector<double> x, y, z;
  for (int i = 0; i < 400; ++i) {
    x.push_back(0.05 * (i % 20));
    y.push_back(0.05 * (i / 20));
    z.push_back(height);
  }
  testing::E57Scan scan;
  scan.records = 400;
  scan.columns = {testing::E57Reals("cartesianX", false, x),
                  testing::E57Reals("cartesianY", false, y),
                  testing::E57Reals("cartesianZ", false, z)};
  scan.more =
      "<pose type=\"Structure\"><translation type=\"Structure\"><x type=\"Float\">0.5</x>"
      "<y type=\"Float\">0.5</y><z type=\"Float\">0</z></translation></pose>";
  return testing::E57File({scan});
}

std::string SquareText() {
  std::string text;
  for (int i = 0; i < 400; ++i) {
    text += std::to_string(1.5 + 0.05 * (i % 20)) + " " + std::to_string(0.5 + 0.05 * (i / 20)) +
            " 0\n";
  }
  return text;
}

TEST_F(AlignTest, ScansOfTwoUnitsAreRefusedUnlessOneIsSaid) {
  Write("a.e57", SquareE57(0));
  Write("b.xyz", SquareText());
  const std::vector<std::string> words = {"reconstruct", At("a.e57"), At("b.xyz"),
                                          "--merge",     "-o",        At("a.dss")};
  const Ended refused = Run(words);
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(Unwrapped(refused.err),
              AllOf(HasSubstr("a.e57"), HasSubstr("b.xyz"), HasSubstr("unit"),
                    HasSubstr("not known"), HasSubstr("--unit")));
  std::vector<std::string> said = words;
  said.insert(said.end(), {"--unit", "m", "--json"});
  const Ended ended = Run(said);
  ASSERT_EQ(ended.code, 0) << ended.err;
  const Json report = Json::parse(ended.out);
  EXPECT_EQ(report["points_in"], 800);
  EXPECT_EQ(report["stations"]["points"], 400) << "those of the E57 file";
}

TEST_F(AlignTest, WrongWordsAreRefused) {
  const std::vector<std::string> views = SimulateApart();
  EXPECT_EQ(Run({"align", views[0]}).code, 2);
  EXPECT_EQ(Run({"align", views[0], views[1], "-o", At("all.obj")}).code, 2);
  EXPECT_EQ(Run({"align", views[0], views[1], "-o", views[1]}).code, 2);
  const std::vector<std::string> two = {"reconstruct", views[0], views[1], "-o", At("a.dss")};
  for (const std::vector<std::string>& more :
       std::vector<std::vector<std::string>>{{},
                                             {"--align"},
                                             {"--keep-scan", At("k.ply")},
                                             {"--merge", "--keep-scan", At("k.obj")}}) {
    EXPECT_EQ(RunOn(two, {}, more).code, 2);
  }
  EXPECT_EQ(Run({"simulate", "star", "-o", At("star.ply"), "--displaced"}).code, 2);
}

}  // namespace
}  // namespace rilievo
