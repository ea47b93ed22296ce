// Figures of closed shapes by the command line, and comparisons that end with exit code 7.
#include <cmath>
#include <numbers>

#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

// A box from (1, 2, 3) with sides 1, 2 and 4, its faces outward.
constexpr char kBox[] =
    "v 1 2 3\nv 2 2 3\nv 2 4 3\nv 1 4 3\nv 1 2 7\nv 2 2 7\nv 2 4 7\nv 1 4 7\n"
    "f 1 4 3\nf 1 3 2\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\n"
    "f 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n";

class MeasureTest : public ProgramFixture {
 protected:
  MeasureTest() { std::ofstream(At("box.obj")) << kBox; }

  Json Figures(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "measure");
    arguments.push_back("--json");
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return Json::parse(ended.out);
  }
};

TEST_F(MeasureTest, OfABoxIsExact) {
  const Json figures = Figures({At("box.obj")});
  EXPECT_TRUE(figures["closed"].get<bool>());
  EXPECT_NEAR(figures["area"].get<double>(), 28, 1e-12);
  EXPECT_NEAR(figures["volume"].get<double>(), 8, 1e-12);
  const double centroid[] = {1.5, 3, 5}, inertia[] = {8 * 20 / 12.0, 8 * 17 / 12.0, 8 * 5 / 12.0};
  for (size_t axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(figures["centroid"][axis].get<double>(), centroid[axis], 1e-12);
    EXPECT_NEAR(figures["inertia"][axis][axis].get<double>(), inertia[axis], 1e-12);
    EXPECT_NEAR(figures["inertia"][axis][(axis + 1) % 3].get<double>(), 0, 1e-12);
  }
  const Ended text = Run({"measure", At("box.obj"), "--plane", "z=4", "--ray", "0,3,5,1,0,0"});
  EXPECT_EQ(text.code, 0);
  EXPECT_LE(WidestLine(text.out), 80u);
  EXPECT_THAT(text.out, HasSubstr("  volume      8\n"));
  EXPECT_THAT(text.out, HasSubstr("enters at 1 3 5"));
}

TEST_F(MeasureTest, OpenShapesHaveNoVolume) {
  std::ofstream(At("sheet.obj")) << "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
  const Json figures = Figures({At("sheet.obj")});
  EXPECT_NEAR(figures["area"].get<double>(), 2, 1e-12);
  EXPECT_TRUE(figures["volume"].is_null());
  EXPECT_THAT(Run({"measure", At("sheet.obj")}).out, HasSubstr("the shape is open"));
}

TEST_F(MeasureTest, SectionsRaysAndDistances) {
  std::ofstream(At("places.xyz")) << "0 3 5\n1.5 3 5\n1.5 3 9\nnan 0 0\n";
  const Json figures = Figures({At("box.obj"), "--plane", "z=4", "2,0,0,3", "-1,0,0,-1.5", "--ray",
                                "0,3,5,2,0,0", "-1,3,5,0,0,1", "--points", At("places.xyz")});
  ASSERT_EQ(figures["sections"].size(), 3u);
  EXPECT_NEAR(figures["sections"][0]["area"].get<double>(), 2, 1e-12);
  EXPECT_NEAR(figures["sections"][1]["area"].get<double>(), 8, 1e-12);
  EXPECT_NEAR(figures["sections"][1]["length"].get<double>(), 12, 1e-12);
  EXPECT_EQ(figures["sections"][1]["normal"][0].get<double>(), 1);
  EXPECT_EQ(figures["sections"][1]["offset"].get<double>(), 1.5);
  EXPECT_NEAR(figures["sections"][2]["area"].get<double>(), 8, 1e-12);
  EXPECT_TRUE(figures["rays"][1]["hits"].empty());
  const Json hits = figures["rays"][0]["hits"];
  ASSERT_EQ(hits.size(), 2u);
  EXPECT_NEAR(hits[0]["distance"].get<double>(), 1, 1e-12);
  EXPECT_NEAR(hits[1]["position"][0].get<double>(), 2, 1e-12);
  EXPECT_TRUE(hits[1]["leaves"].get<bool>());
  EXPECT_EQ(figures["points"]["points"], 3);
  EXPECT_EQ(figures["points"]["outside"], 2);
  EXPECT_NEAR(figures["points"]["least"].get<double>(), -0.5, 1e-12);
  EXPECT_NEAR(figures["points"]["greatest"].get<double>(), 2, 1e-12);
  EXPECT_NEAR(figures["points"]["mean"].get<double>(), 2.5 / 3, 1e-12);
}

TEST_F(MeasureTest, WritesSectionsForThreePrograms) {
  for (const std::string extension : {"obj", "dxf", "svg"}) {
    const std::string path = At("cut." + extension);
    ASSERT_EQ(Run({"measure", At("box.obj"), "--plane", "z=4", "--sections", path}).code, 0);
    EXPECT_THAT(Content(path), HasSubstr(extension == "obj"   ? "\nl 1 2 "
                                         : extension == "dxf" ? "POLYLINE"
                                                              : "viewBox=\"0 0 1 2\""));
  }
}

// What an export of a scanned torus measures, against the closed form.
TEST_F(MeasureTest, OfAReconstructedTorus) {
  ASSERT_EQ(Run({"simulate", "torus", "-o", At("scan.ply"), "--points", "20000"}).code, 0);
  ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
  const Json figures = Figures({At("a.dss"), "--plane", "z=0"});
  const double ring = 0.7, tube = 0.28;
  EXPECT_NEAR(figures["area"].get<double>() / (4 * kPi * kPi * ring * tube), 1, 2e-3);
  EXPECT_NEAR(figures["volume"].get<double>() / (2 * kPi * kPi * ring * tube * tube), 1, 2e-3);
  EXPECT_EQ(figures["sections"][0]["polylines"].size(), 2u);
  EXPECT_NEAR(figures["sections"][0]["length"].get<double>() / (4 * kPi * ring), 1, 2e-3);
  const Json exported = [&] {
    EXPECT_EQ(Run({"export", At("a.dss"), At("a.obj")}).code, 0);
    return Figures({At("a.obj")});
  }();
  EXPECT_NEAR(figures["volume"].get<double>(), exported["volume"].get<double>(), 1e-12);
}

TEST_F(MeasureTest, RefusesWhatIsNoPlane) {
  const auto refused = [&](std::vector<std::string> arguments, int code, const std::string& said) {
    arguments.insert(arguments.begin(), {"measure", At("box.obj")});
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, code) << ended.err;
    std::string error = ended.err;  // without its line breaks
    for (size_t at; (at = error.find("\n  ")) != std::string::npos;) error.replace(at, 3, " ");
    EXPECT_THAT(error, HasSubstr(said));
    EXPECT_EQ(ended.out, "");
  };
  refused({"--plane", "w=2"}, 2, "--plane w=2: must be");
  refused({"--plane", "0,0,0,1"}, 2, "--plane 0,0,0,1: must be");
  refused({"--ray", "0,0,0,0,0,0"}, 2, "--ray 0,0,0,0,0,0: must be");
  refused({"--sections", At("a.svg")}, 2, "needs --plane");
  refused({"--plane", "z=4", "x=1.5", "--sections", At("a.svg")}, 2, "holds one");
  refused({"--plane", "z=4", "--sections", At("a.ply")}, 2, ".obj, .dxf or .svg");
  refused({"--plane", "z=40", "--sections", At("a.svg")}, 6, "does not meet");
  refused({"--plane", "z=4", "--sections", At("box.obj")}, 2, "overwrite");
  std::ofstream(At("few.xyz")) << "0 0 0\n1 0 0\n";
  const Ended points = Run({"measure", At("few.xyz")});
  EXPECT_EQ(points.code, 3);
  EXPECT_THAT(points.err, HasSubstr("no triangles"));
}

TEST_F(MeasureTest, ComparisonsEndWithSevenWhereBoundsAreExceeded) {
  std::ofstream(At("moved.obj")) << "v 1.1 2 3\n" << std::string(kBox).substr(8);
  const auto compare = [&](const std::vector<std::string>& bounds) {
    std::vector<std::string> words = {"compare", At("box.obj"), At("moved.obj"), "--json"};
    words.insert(words.end(), bounds.begin(), bounds.end());
    return Run(words);
  };
  const Ended free = compare({});
  ASSERT_EQ(free.code, 0);
  const Json found = Json::parse(free.out);
  EXPECT_FALSE(found.contains("within_bounds"));
  const double rms = found["rms_percent"].get<double>() / 100,
               max = found["max_percent"].get<double>() / 100;
  ASSERT_GT(rms, 0);
  const auto text = [](double bound) { return std::to_string(bound); };
  const Ended kept = compare({"--max-rms", text(2 * rms), "--max-distance", text(2 * max)});
  EXPECT_EQ(kept.code, 0) << kept.err;
  EXPECT_TRUE(Json::parse(kept.out)["within_bounds"].get<bool>());
  for (const std::vector<std::string>& bounds :
       {std::vector<std::string>{"--max-rms", text(rms / 2)},
        {"--max-rms", text(2 * rms), "--max-distance", text(max / 2)}}) {
    const Ended exceeded = compare(bounds);
    EXPECT_EQ(exceeded.code, 7);
    EXPECT_FALSE(Json::parse(exceeded.out)["within_bounds"].get<bool>());
    EXPECT_THAT(exceeded.err, HasSubstr("of A's diagonal"));
  }
  EXPECT_EQ(compare({"--max-rms", "2"}).code, 2);
  EXPECT_EQ(Run({"compare", At("box.obj"), At("box.obj"), "--max-distance", "0.000001"}).code, 0);
}

}  // namespace
}  // namespace rilievo
