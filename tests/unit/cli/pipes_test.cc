// Standard input and output as files, and several scans at once.
#include "client/formats/mesh_reader.h"
#include "client/formats/scan_reader.h"
#include "tests/unit/cli/program_fixture.h"
#include "tests/unit/formats/packed_bytes.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using PipesTest = ProgramFixture;

TEST_F(PipesTest, ScanInSurfaceOut) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "2000"}).code, 0);
  ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
  const Ended simulated = Run({"simulate", "sphere", "-o", "-", "--points", "2000"});
  EXPECT_EQ(simulated.out, Content(At("scan.ply")));
  EXPECT_THAT(simulated.err, HasSubstr("2,000 points"));

  const Ended piped = RunPiped(simulated.out, {"reconstruct", "-", "-o", "-", "--report", At("r")});
  ASSERT_EQ(piped.code, 0) << piped.err;
  EXPECT_EQ(piped.out, Content(At("a.dss")));
  EXPECT_THAT(piped.err, HasSubstr("control faces"));
  EXPECT_EQ(Json::parse(Content(At("r")))["scan"], "-");

  const Ended info = RunPiped(piped.out, {"info", "-", "--json"});
  ASSERT_EQ(info.code, 0) << info.err;
  EXPECT_EQ(Json::parse(info.out)["bytes"], piped.out.size());
  EXPECT_EQ(RunPiped(piped.out, {"verify", "-", At("scan.ply")}).code, 0);
  for (const char* format : {"ply", "obj", "stl"}) {
    const std::string name = At(std::string("mesh.") + format);
    const Ended exported = RunPiped(piped.out, {"export", "-", "-", "--format", format});
    ASSERT_EQ(exported.code, 0) << exported.err;
    const Ended to_file = Run({"export", At("a.dss"), name, "--json"});
    EXPECT_GT(Json::parse(to_file.out)["faces"], 1000);
    EXPECT_EQ(exported.out, Content(name));
  }
  EXPECT_EQ(RunPiped(simulated.out, {"verify", At("a.dss"), "-"}).code, 0);
  const Ended compared = RunPiped(piped.out, {"compare", "-", At("a.dss"), "--json"});
  ASSERT_EQ(compared.code, 0) << compared.err;
  const Json found = Json::parse(compared.out);
  EXPECT_LT(found["max"], 1e-14);
  EXPECT_EQ(found["heights_a"], found["heights_b"]);
  EXPECT_GT(found["heights_a"]["measured"].get<int>() + found["heights_a"]["smoothed"].get<int>(),
            0);
}

TEST_F(PipesTest, CompressedFilesAreReadAsTheyAre) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "2000"}).code, 0);
  ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
  const std::string gzip = testing::Gzip(Content(At("scan.ply")));
  std::ofstream(At("b.ply.gz"), std::ios::binary) << gzip;
  std::ofstream(At("c.ply.zst"), std::ios::binary) << testing::Zstd(Content(At("scan.ply")));
  // Several scans: their surfaces are named without either extension.
  const Ended many = Run({"reconstruct", At("b.ply.gz"), At("c.ply.zst"), "-o", At("many/")});
  ASSERT_EQ(many.code, 0) << many.err;
  EXPECT_EQ(Content(At("many/b.dss")), Content(At("a.dss")));
  EXPECT_EQ(Content(At("many/c.dss")), Content(At("a.dss")));
  const Ended piped = RunPiped(gzip, {"reconstruct", "-", "-o", "-", "--quiet"});
  EXPECT_EQ(piped.out, Content(At("a.dss")));
  std::ofstream(At("a.dss.gz"), std::ios::binary) << testing::Gzip(Content(At("a.dss")));
  EXPECT_EQ(Run({"verify", At("a.dss.gz"), At("b.ply.gz")}).code, 0);

  const Ended cut = RunPiped(gzip.substr(0, gzip.size() / 2), {"diagnose", "-"});
  EXPECT_EQ(cut.code, 3);
  EXPECT_THAT(cut.err, HasSubstr("-: gzip: the compressed data break off"));
  std::ofstream(At("bomb.xyz.gz"), std::ios::binary)
      << testing::Gzip(std::string(size_t{80} << 20, '\n'));
  const Ended bomb = Run({"diagnose", At("bomb.xyz.gz")});
  EXPECT_EQ(bomb.code, 3);
  EXPECT_THAT(bomb.err, HasSubstr("unpack it first"));
}

TEST_F(PipesTest, TheFormatIsToldWhereTheBytesDoNot) {
  const std::string headed = "left right height\n0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(RunPiped(headed, {"compare", "-", "-"}).code, 2);
  std::ofstream(At("a.xyz")) << "0 0 0\n1 0 0\n0 1 0\n";
  const Ended untold = RunPiped(headed, {"compare", "-", At("a.xyz")});
  EXPECT_EQ(untold.code, 3);
  EXPECT_THAT(untold.err, HasSubstr("-: "));
  const std::string cloud = "o cloud\nv 0 0 0\nv 1 0 0\nv 0 1 0\n";
  EXPECT_EQ(RunPiped(cloud, {"compare", "-", At("a.xyz")}).code, 3);
  const Ended told = RunPiped(cloud, {"compare", "-", At("a.xyz"), "--format", "obj", "--json"});
  ASSERT_EQ(told.code, 0) << told.err;
  EXPECT_EQ(Json::parse(told.out)["max"], 0);
}

TEST_F(PipesTest, TwoResultsDoNotShareTheStandardOutput) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "500"}).code, 0);
  EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", "-", "--json"}).code, 2);
  EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", "-", "--report", "-"}).code, 2);
  EXPECT_EQ(Run({"simulate", "sphere", "-o", "-", "--json"}).code, 2);
  const Ended report = Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--report", "-"});
  ASSERT_EQ(report.code, 0) << report.err;
  EXPECT_EQ(Json::parse(report.out)["points_in"], 500);
}

TEST_F(PipesTest, AStandardOutputThatIsFullIsAnError) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "500"}).code, 0);
  const std::string command = RILIEVO_PROGRAM " compare " + At("scan.ply") + " " + At("scan.ply");
  const int full = std::system((command + " >/dev/full 2>" + At("said")).c_str());
  EXPECT_EQ(WEXITSTATUS(full), 6);
  EXPECT_THAT(Content(At("said")), HasSubstr("standard output"));
}

TEST_F(PipesTest, SeveralScansBecomeSeveralSurfaces) {
  for (const char* shape : {"sphere", "torus"}) {
    ASSERT_EQ(
        Run({"simulate", shape, "-o", At(std::string(shape) + ".ply"), "--points", "3000"}).code,
        0);
  }
  const Ended made = Run({"reconstruct", At("sphere.ply"), At("torus.ply"), "-o", At("new/in/")});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("sphere.dss: 3,000 points"));
  EXPECT_THAT(made.out, HasSubstr("genus 1,"));
  EXPECT_EQ(Run({"info", At("new/in/torus.dss")}).code, 0);
  // Each as when it is made alone.
  ASSERT_EQ(Run({"reconstruct", At("torus.ply"), "-o", At("alone.dss"), "--quiet"}).code, 0);
  EXPECT_EQ(Content(At("alone.dss")), Content(At("new/in/torus.dss")));
}

TEST_F(PipesTest, AScanThatFailsStopsNoOther) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("good.ply"), "--points", "2000"}).code, 0);
  std::ofstream(At("bad.xyz")) << "1 2\n";
  const std::vector<std::string> arguments = {
      "reconstruct", At("bad.xyz"), At("none.ply"), At("good.ply"), "-o", At("out/"), "--quiet"};
  const Ended made = Run(arguments);
  EXPECT_EQ(made.code, 3);
  EXPECT_THAT(made.err, HasSubstr("bad.xyz: failed: "));
  EXPECT_THAT(made.err, HasSubstr("none.ply: failed: "));
  EXPECT_THAT(made.err, HasSubstr("2 of 3 failed"));
  EXPECT_THAT(made.out, HasSubstr("good.dss"));
  EXPECT_FALSE(fs::exists(At("out/bad.dss")));
  EXPECT_TRUE(fs::exists(At("out/good.dss")));

  std::vector<std::string> as_json = arguments;
  as_json.push_back("--json");
  const Json list = Json::parse(Run(as_json).out);
  ASSERT_EQ(list.size(), 3u);
  EXPECT_EQ(list[0]["error"]["code"], "INVALID_ARGUMENT");
  EXPECT_EQ(list[1]["error"]["code"], "NOT_FOUND");
  EXPECT_EQ(list[2]["points_in"], 2000);
}

TEST_F(PipesTest, SeveralScansNeedAFolderAndNamesOfTheirOwn) {
  fs::create_directories(At("b"));
  for (const char* name : {"a.ply", "b/a.ply"}) {
    ASSERT_EQ(Run({"simulate", "sphere", "-o", At(name), "--points", "500"}).code, 0);
  }
  const Ended no_folder = Run({"reconstruct", At("a.ply"), At("b/a.ply"), "-o", At("c.dss")});
  EXPECT_EQ(no_folder.code, 2);
  EXPECT_THAT(no_folder.err, HasSubstr("c.dss/"));
  EXPECT_EQ(Run({"reconstruct", At("a.ply"), At("b/a.ply"), "-o", At("c/")}).code, 2);
  EXPECT_EQ(Run({"reconstruct", "-", "-", "-o", At("c/")}).code, 2);
  EXPECT_FALSE(fs::exists(At("c/a.dss")));
}

}  // namespace
}  // namespace rilievo
