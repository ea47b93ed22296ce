// `rilievo convert`: from a mesh file to a surface.
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class ConvertTest : public ProgramFixture {
 protected:
  // A torus as mesh files of all kinds: that of a surface.
  void SetUp() override {
    ASSERT_EQ(Run({"simulate", "torus", "-o", At("scan.ply"), "--points", "3000"}).code, 0);
    ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("scan.dss"), "--quiet"}).code, 0);
    for (const char* extension : {"ply", "obj", "stl", "glb"}) {
      ASSERT_EQ(
          Run({"export", At("scan.dss"), At(std::string("m.") + extension), "--level", "2"}).code,
          0);
    }
  }
};

TEST_F(ConvertTest, EveryFormatBecomesTheSameShape) {
  for (const std::string extension : {"ply", "obj", "stl", "glb"}) {
    const std::string mesh = At("m." + extension), surface = At("s_" + extension + ".dss");
    const Ended made = Run({"convert", mesh, "-o", surface, "--control-faces", "400", "--max-level",
                            "3", "--json", "--quiet"});
    ASSERT_EQ(made.code, 0) << made.err;
    const Json report = Json::parse(made.out);
    EXPECT_EQ(report["genus"], 1) << extension;
    EXPECT_EQ(report["boundary_loops"], 0) << extension;
    EXPECT_EQ(report["road"], "mesh");
    EXPECT_GT(report["mesh"]["triangles_used"], 500);
    EXPECT_EQ(report["mesh"]["opened_edges"], 0);
    const Ended near = Run({"compare", mesh, surface, "--max-rms", "1e-4"});
    EXPECT_EQ(near.code, 0) << extension << near.out;
    const Ended verified = Run({"verify", surface, mesh});
    EXPECT_EQ(verified.code, 0) << verified.out << verified.err;
  }
  const Ended other = Run({"verify", At("s_ply.dss"), At("m.stl")});
  EXPECT_EQ(other.code, 7);
  EXPECT_THAT(other.err, HasSubstr("is not what the surface was made from"));
}

TEST_F(ConvertTest, CatmullClarkSurfacesLieOverQuads) {
  const Ended made = Run({"convert", At("m.ply"), "-o", At("q.dss"), "--scheme", "catmull-clark",
                          "--control-faces", "400", "--max-level", "3", "--quiet", "--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  const Json report = Json::parse(made.out);
  EXPECT_EQ(report["genus"], 1);
  const Json info = Json::parse(Run({"info", At("q.dss"), "--json"}).out);
  EXPECT_EQ(info["scheme"], "catmull-clark");
  EXPECT_EQ(info["format_version"], 5);
  EXPECT_THAT(Run({"info", At("q.dss")}).out, HasSubstr("Catmull-Clark over quads"));
  EXPECT_EQ(Run({"compare", At("m.ply"), At("q.dss"), "--max-rms", "1e-4"}).code, 0);
  const Ended verified = Run({"verify", At("q.dss"), At("m.ply")});
  EXPECT_EQ(verified.code, 0) << verified.out << verified.err;

  // Its control mesh has the quads, and put back gives the same bytes.
  const Ended exported = Run({"export", At("q.dss"), At("cage.obj"), "--cage", "--json"});
  ASSERT_EQ(exported.code, 0) << exported.err;
  const std::string cage = Content(At("cage.obj"));
  const auto quads = std::count(cage.begin(), cage.end(), 'f');
  EXPECT_EQ(2 * quads, info["levels"][0]["faces"]);
  EXPECT_EQ(Json::parse(exported.out)["faces"], quads);
  const Ended moved = Run({"deform", At("q.dss"), "--cage", At("cage.obj"), "-o", At("t.dss")});
  ASSERT_EQ(moved.code, 0) << moved.err;
  EXPECT_EQ(Content(At("t.dss")), Content(At("q.dss")));
  ASSERT_EQ(Run({"export", At("q.dss"), At("q.usda"), "--level", "1"}).code, 0);
  EXPECT_THAT(Content(At("q.usda")), HasSubstr("subdivisionScheme = \"catmullClark\""));

  // Scaled, or brought up to date, it stays over quads.
  ASSERT_EQ(Run({"scale", At("q.dss"), "--to", "3,2,1", "-o", At("scaled.dss")}).code, 0);
  ASSERT_EQ(Run({"update", At("q.dss"), At("m.ply"), "--points-only", "-o", At("u.dss")}).code, 0);
  for (const char* name : {"scaled.dss", "u.dss"}) {
    const Json after = Json::parse(Run({"info", At(name), "--json"}).out);
    EXPECT_EQ(after["scheme"], "catmull-clark") << name;
    EXPECT_EQ(after["levels"], info["levels"]) << name;
  }

  const Ended evaluated = Run({"evaluate", At("q.dss"), "--at", "0,0.25,0.5", "--json"});
  EXPECT_EQ(evaluated.code, 0) << evaluated.err;
  EXPECT_THAT(evaluated.out, HasSubstr("\"position\""));
}

TEST_F(ConvertTest, SaysWhatBecameOfTheTriangles) {
  const Ended made =
      Run({"convert", At("m.stl"), "-o", At("s.dss"), "--max-level", "2", "--quiet"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("triangles"));
  EXPECT_THAT(made.out, HasSubstr("genus 1"));
  EXPECT_LE(WidestLine(made.out), 80u);
}

TEST_F(ConvertTest, PointsAloneAreRefusedWithTheCommandForThem) {
  const Ended refused = Run({"convert", At("scan.ply"), "-o", At("s.dss")});
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.err, HasSubstr("rilievo reconstruct"));
  EXPECT_FALSE(fs::exists(At("s.dss")));
  // And the other way round.
  const Ended mesh = Run({"reconstruct", At("m.ply"), "-o", At("s.dss")});
  EXPECT_THAT(mesh.err, HasSubstr("rilievo convert"));
}

TEST_F(ConvertTest, NeverWritesOverItsInput) {
  const std::string before = Content(At("m.ply"));
  EXPECT_EQ(Run({"convert", At("m.ply"), "-o", At("m.ply")}).code, 2);
  EXPECT_EQ(Content(At("m.ply")), before);
}

TEST_F(ConvertTest, SeveralMeshesGoIntoAFolder) {
  const auto convert = [&](const char* last) {
    return Run({"convert", At("m.ply"), At("scan.ply"), At(last), "-o", At("out/"), "--max-level",
                "2", "--quiet"});
  };
  const Ended made = convert("m.obj");
  EXPECT_EQ(made.code, 2) << made.err;  // two of one name
  fs::rename(At("m.obj"), At("n.obj"));
  const Ended again = convert("n.obj");
  EXPECT_EQ(again.code, 3);
  EXPECT_THAT(again.err, HasSubstr("1 of 3 failed"));
  EXPECT_TRUE(fs::exists(At("out/m.dss")));
  EXPECT_TRUE(fs::exists(At("out/n.dss")));
}

}  // namespace
}  // namespace rilievo
