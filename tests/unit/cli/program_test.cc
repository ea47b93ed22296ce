// The program as people start it: a process, files, exit codes.
#include <chrono>
#include <thread>

#include "client/formats/mesh_reader.h"
#include "client/formats/scan_reader.h"
#include "client/picture/image.h"
#include "core/geometry/mesh_topology.h"
#include "tests/scans/scanner.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

using ProgramTest = ProgramFixture;

TEST_F(ProgramTest, HelpFitsTheTerminalAndTellsTheExitCodes) {
  const Ended help = Run({"--help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_THAT(help.out, HasSubstr("Exit codes:"));
  EXPECT_LE(WidestLine(help.out), 80u);
  for (const char* command :
       {"reconstruct", "export", "info", "verify", "compare", "simulate", "view"}) {
    EXPECT_THAT(help.out, HasSubstr(command));
    const Ended page = Run({command, "--help"});
    EXPECT_EQ(page.code, 0);
    EXPECT_LE(WidestLine(page.out), 80u) << page.out;
  }
  EXPECT_THAT(Run({"--version"}).out, ::testing::StartsWith("rilievo "));
}

TEST_F(ProgramTest, WrongCommandLinesEndWithTwo) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {},
           {"polish"},
           {"reconstruct"},
           {"reconstruct", "a.ply"},
           {"reconstruct", "a.ply", "-o", "b.dss", "--max-level", "9"},
           {"reconstruct", "a.ply", "-o", "b.dss", "--topology", "flat"},
           {"reconstruct", "a.ply", "-o", "b.dss", "--creases", "sharp"},
           {"simulate", "cow", "-o", "a.ply"},
           {"simulate", "star", "-o", "a.ply", "--noise", "2"},
           {"export", "a.dss", "b.blend"},
           {"view", "a.ply", "-o", "b.png", "--size", "axb"}}) {
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, 2) << ended.err;
    EXPECT_FALSE(ended.err.empty());
    EXPECT_LE(WidestLine(ended.err), 80u) << ended.err;
  }
}

TEST_F(ProgramTest, BadInputEndsWithThreeAndWritesNothing) {
  std::ofstream(At("bad.ply")) << "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\n"
                                  "end_header\n";
  const Ended ended = Run({"reconstruct", At("bad.ply"), "-o", At("a.dss"), "--report", At("r")});
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("'y'"));
  EXPECT_FALSE(fs::exists(At("a.dss")) || fs::exists(At("r")));
  EXPECT_EQ(Run({"reconstruct", At("none.ply"), "-o", At("a.dss")}).code, 3);
  EXPECT_EQ(Run({"info", At("bad.ply")}).code, 3);
  EXPECT_EQ(Run({"export", At("bad.ply"), At("a.ply")}).code, 3);
  EXPECT_EQ(Run({"compare", At("bad.ply"), At("bad.ply")}).code, 3);
  EXPECT_EQ(Run({"view", At("bad.ply"), "-o", At("a.png")}).code, 3);
}

TEST_F(ProgramTest, FewPointsAreRefusedInWords) {
  std::ofstream(At("few.xyz")) << "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n";
  const Ended ended = Run({"reconstruct", At("few.xyz"), "-o", At("a.dss")});
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("at least 20"));
}

TEST_F(ProgramTest, OutputThatCannotBeWrittenEndsWithSix) {
  EXPECT_EQ(Run({"simulate", "sphere", "-o", At("no/such/a.ply"), "--points", "100"}).code, 6);
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("a.ply"), "--points", "100"}).code, 0);
  EXPECT_EQ(Run({"reconstruct", At("a.ply"), "-o", At("no/such/a.dss")}).code, 6);
  EXPECT_EQ(Run({"view", At("a.ply"), "-o", At("no/such/a.png")}).code, 6);
}

TEST_F(ProgramTest, AnAbsentServerEndsWithFour) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("a.ply"), "--points", "100"}).code, 0);
  const Ended ended =
      Run({"reconstruct", At("a.ply"), "-o", At("a.dss"), "--server", "127.0.0.1:1"});
  EXPECT_EQ(ended.code, 4) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("127.0.0.1:1"));
  EXPECT_FALSE(fs::exists(At("a.dss")));
}

TEST_F(ProgramTest, SimulateWritesTheScanOfTheLibrary) {
  ASSERT_EQ(Run({"simulate", "star", "-o", At("a.ply"), "--points", "500", "--views", "3",
                 "--noise", "0.001", "--seed", "5", "--normals"})
                .code,
            0);
  ScannerOptions options;
  options.points = 500;
  options.views = 3;
  options.noise = 0.001;
  options.seed = 5;
  const auto scan = ReadScan(At("a.ply"));
  ASSERT_TRUE(scan.ok()) << scan.status();
  EXPECT_TRUE(scan->cloud.points == SimulateScan(*MakeStar(), options)->cloud.points);
}

TEST_F(ProgramTest, CompareMeasuresKnownDistances) {
  // Two unit squares, one a tenth above the other.
  std::ofstream(At("a.obj")) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
  std::ofstream(At("b.obj")) << "v 0 0 .1\nv 1 0 .1\nv 1 1 .1\nv 0 1 .1\nf 1 2 3 4\n";
  const Ended ended = Run({"compare", At("a.obj"), At("b.obj"), "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const Json json = Json::parse(ended.out);
  EXPECT_NEAR(json["rms"], 0.1, 1e-12);
  EXPECT_NEAR(json["max"], 0.1, 1e-12);
  EXPECT_NEAR(json["rms_percent"], 10 / std::sqrt(2.0), 1e-9);
  const Ended text = Run({"compare", At("a.obj"), At("b.obj")});
  EXPECT_THAT(text.out, HasSubstr("0.100"));
  EXPECT_LE(WidestLine(text.out.substr(text.out.find("distance"))), 80u);
}

TEST_F(ProgramTest, ViewDrawsAMeshAndAScan) {
  std::ofstream(At("a.obj")) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
  ASSERT_EQ(Run({"simulate", "torus", "-o", At("a.ply"), "--points", "3000"}).code, 0);
  for (const char* input : {"a.obj", "a.ply"}) {
    const Ended ended = Run({"view", At(input), "-o", At("a.png"), "--size", "200x100"});
    ASSERT_EQ(ended.code, 0) << ended.err;
    const auto image = DecodePng(Content(At("a.png")));
    ASSERT_TRUE(image.ok()) << image.status();
    EXPECT_EQ(image->width, 200);
    EXPECT_EQ(image->height, 100);
    EXPECT_THAT(image->rgb, ::testing::Contains(::testing::Lt(200)));
  }
}

TEST_F(ProgramTest, FromScanToSurfaceToMesh) {
  ASSERT_EQ(Run({"simulate", "torus", "-o", At("scan.ply"), "--points", "12000"}).code, 0);
  const Ended made = Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--report",
                          At("r.json"), "--max-level", "2"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("genus 1"));
  EXPECT_LE(WidestLine(made.out), 80u) << made.out;
  EXPECT_THAT(made.err, HasSubstr("/8] "));  // which stages are told depends on how busy it is
  EXPECT_EQ(made.err.find('\r'), std::string::npos);

  const Json report = Json::parse(Content(At("r.json")));
  EXPECT_EQ(report["points_in"], 12000);
  EXPECT_EQ(report["genus"], 1);
  EXPECT_EQ(report["max_level"], 2);
  EXPECT_EQ(report["encoded_bytes"], fs::file_size(At("a.dss")));
  EXPECT_LT(report["error"]["rms"], 0.01);

  const Ended info = Run({"info", At("a.dss"), "--json"});
  ASSERT_EQ(info.code, 0) << info.err;
  const Json facts = Json::parse(info.out);
  EXPECT_EQ(facts["bytes"], fs::file_size(At("a.dss")));
  EXPECT_EQ(facts["genus"], 1);
  EXPECT_EQ(facts["closed"], true);
  EXPECT_EQ(facts["levels"].size(), 3u);
  EXPECT_LE(WidestLine(Run({"info", At("a.dss")}).out), 80u);

  for (const char* extension : {"ply", "obj", "stl"}) {
    for (int level = 0; level <= 2; ++level) {
      const std::string path = At(std::string("mesh.") + extension);
      const Ended exported = Run({"export", At("a.dss"), path, "--level", std::to_string(level)});
      ASSERT_EQ(exported.code, 0) << exported.err;
      const auto mesh = ReadMesh(path);
      ASSERT_TRUE(mesh.ok()) << mesh.status();
      EXPECT_EQ(mesh->mesh.vertices.cols(), facts["levels"][level]["vertices"]);
      EXPECT_EQ(mesh->mesh.triangles.cols(), facts["levels"][level]["faces"]);
      const TopologySummary topology =
          SummarizeTopology(mesh->mesh.triangles, static_cast<int>(mesh->mesh.vertices.cols()));
      EXPECT_TRUE(topology.closed() && topology.manifold());
      EXPECT_EQ(topology.genus, 1);
    }
    const auto finest = ReadMesh(At(std::string("mesh.") + extension));
    const ShapeError error = MeasureAgainstShape(*MakeTorus(), finest->mesh.vertices);
    EXPECT_LT(error.rms, 0.002 * MakeTorus()->diagonal()) << extension;
  }
  EXPECT_EQ(Run({"export", At("a.dss"), At("a.ply"), "--level", "9"}).code, 3);
  for (const std::vector<std::string>& few :
       std::vector<std::vector<std::string>>{{"--tolerance", "0.002"}, {"--triangles", "3000"}}) {
    const Ended exported = Run({"export", At("a.dss"), At("few.ply"), few[0], few[1]});
    ASSERT_EQ(exported.code, 0) << exported.err;
    const auto mesh = ReadMesh(At("few.ply"));
    EXPECT_LE(mesh->mesh.triangles.cols(), 3000);
    EXPECT_EQ(mesh->source.size(), static_cast<size_t>(mesh->mesh.vertices.cols()));
    EXPECT_TRUE(
        SummarizeTopology(mesh->mesh.triangles, static_cast<int>(mesh->mesh.vertices.cols()))
            .closed());
  }
  EXPECT_EQ(Run({"export", At("a.dss"), At("a.ply"), "--level", "1", "--tolerance", "0.1"}).code,
            2);
  EXPECT_EQ(Run({"export", At("a.dss"), At("a.ply"), "--triangles", "3"}).code, 3);

  const Ended compared = Run({"compare", At("a.dss"), At("mesh.ply"), "--json"});
  ASSERT_EQ(compared.code, 0) << compared.err;
  EXPECT_LT(Json::parse(compared.out)["max_percent"], 1e-4);

  for (const char* color : {"shade", "displacement", "flags", "normals"}) {
    EXPECT_EQ(
        Run({"view", At("a.dss"), "-o", At("a.png"), "--colors", color, "--size", "160"}).code, 0);
  }
}

TEST_F(ProgramTest, ACutSurfaceFileIsRefused) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "2000"}).code, 0);
  ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
  const std::string bytes = Content(At("a.dss"));
  std::ofstream(At("cut.dss"), std::ios::binary) << bytes.substr(0, bytes.size() / 3);
  const Ended ended = Run({"info", At("cut.dss")});
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("cut.dss"));
}

TEST_F(ProgramTest, VerifyConfirmsAFileAndTellsAnother) {
  ASSERT_EQ(Run({"simulate", "torus", "-o", At("scan.ply"), "--points", "4000"}).code, 0);
  ASSERT_EQ(
      Run({"simulate", "torus", "-o", At("other.ply"), "--points", "4000", "--seed", "9"}).code, 0);
  ASSERT_EQ(
      Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet", "--max-error", "0.001"})
          .code,
      0);
  const Ended same = Run({"verify", At("a.dss"), At("scan.ply"), "--json"});
  ASSERT_EQ(same.code, 0) << same.err;
  const Json json = Json::parse(same.out);
  EXPECT_EQ(json["agrees"], true);
  EXPECT_EQ(json["scan"], "same");
  EXPECT_EQ(json["options"], "max_error=0.001");
  EXPECT_EQ(json["figures"].size(), 18u);
  EXPECT_NEAR(double{json["figures"]["rms"]["found"]}, double{json["figures"]["rms"]["stated"]},
              3e-4 * double{json["figures"]["rms"]["found"]});
  const Ended text = Run({"verify", At("a.dss")});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("agrees"));

  const Ended other = Run({"verify", At("a.dss"), At("other.ply")});
  EXPECT_EQ(other.code, 7);
  EXPECT_THAT(other.err, HasSubstr("is not what the surface was made from"));
  std::string bytes = Content(At("a.dss"));
  bytes[bytes.size() / 2] ^= 4;
  std::ofstream(At("flipped.dss"), std::ios::binary) << bytes;
  const Ended flipped = Run({"verify", At("flipped.dss"), At("scan.ply")});
  EXPECT_EQ(flipped.code, 3);
  EXPECT_THAT(flipped.err, HasSubstr("flipped.dss"));
}

TEST_F(ProgramTest, TheGivenControlMeshIsUsed) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "3000"}).code, 0);
  std::ofstream(At("octahedron.obj"))
      << "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\nf 1 3 5\nf 3 2 5\nf 2 4 5\n"
         "f 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n";
  const Ended made = Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--control-mesh",
                          At("octahedron.obj"), "--max-level", "3", "--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  const Json report = Json::parse(made.out);
  EXPECT_EQ(report["road"], "user");
  EXPECT_EQ(report["control_faces"], 8);
  std::ofstream(At("creased.obj"))
      << Content(At("octahedron.obj")) << "t crease 3/2/0 0 2 1 2.5 10\nt corner 1/1/0 5 10\n";
  ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("c.dss"), "--control-mesh",
                 At("creased.obj"), "--max-level", "3"})
                .code,
            0);
  ASSERT_EQ(Run({"export", At("c.dss"), At("c.obj"), "--cage"}).code, 0);
  const std::string cage = Content(At("c.obj"));
  EXPECT_THAT(cage, AllOf(HasSubstr(" 2.5\n"), HasSubstr("t crease"), HasSubstr("t corner")));
  EXPECT_EQ(
      Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--control-mesh", At("scan.ply")})
          .code,
      3);
}

TEST_F(ProgramTest, CtrlCCancelsWithinASecondAndLeavesNoFile) {
  ASSERT_EQ(Run({"simulate", "genus2", "-o", At("scan.ply"), "--points", "300000"}).code, 0);
  std::ofstream(At("a.dss")) << "older";
  const pid_t child = Start({"reconstruct", At("scan.ply"), "-o", At("a.dss")});
  std::this_thread::sleep_for(std::chrono::milliseconds(700));
  kill(child, SIGINT);
  const auto asked = std::chrono::steady_clock::now();
  const Ended ended = Wait(child);
  const double waited =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - asked).count();
  EXPECT_EQ(ended.code, 5) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("cancelled"));
  EXPECT_LT(waited, 3.0);  // a second, and room for a busy machine
  EXPECT_EQ(Content(At("a.dss")), "older");
}

}  // namespace
}  // namespace rilievo
