// `rilievo combine`: two solids become one surface.
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class CombineTest : public ProgramFixture {
 protected:
  void SetUp() override {
    WriteBox("a.obj", 0, 0, 0, 2);
    WriteBox("b.obj", 1, 1, 1, 2);
    WriteBox("far.obj", 5, 5, 5, 2);
  }

  // A cube, its corner with the lowest coordinates at (x, y, z).
  void WriteBox(const std::string& name, double x, double y, double z, double side) const {
    std::ofstream out(At(name));
    out.precision(12);
    for (int i = 0; i < 8; ++i) {
      out << "v " << x + side * (i & 1) << ' ' << y + side * (i >> 1 & 1) << ' '
          << z + side * (i >> 2) << '\n';
    }
    // Counted from the end, so that files may be put one after the other.
    out << "f -8 -6 -5 -7\nf -4 -3 -1 -2\nf -8 -7 -3 -4\nf -6 -2 -1 -5\nf -8 -4 -2 -6\n"
           "f -7 -5 -1 -3\n";
  }

  // A surface of few triangles of a.obj.
  void WriteSurface(const std::string& name) const {
    ASSERT_EQ(Run({"convert", At("a.obj"), "-o", At(name), "--unit", "mm", "--control-faces", "100",
                   "--max-level", "1", "--quiet"})
                  .code,
              0);
  }

  double VolumeOf(const std::string& path) const {
    const Ended measured = Run({"measure", path, "--json"});
    EXPECT_EQ(measured.code, 0) << measured.err;
    return Json::parse(measured.out)["volume"];
  }
};

TEST_F(CombineTest, BoxesHaveTheVolumesThatTheyShould) {
  const std::pair<const char*, double> operations[] = {
      {"--union", 15}, {"--intersection", 1}, {"--difference", 7}};
  for (const auto& [operation, volume] : operations) {
    const std::string surface = At(std::string("c") + operation + ".dss");
    const std::string triangles = At(std::string("c") + operation + ".ply");
    const Ended made =
        Run({"combine", At("a.obj"), At("b.obj"), operation, "-o", surface, "--keep-mesh",
             triangles, "--control-faces", "400", "--max-level", "3", "--json", "--quiet"});
    ASSERT_EQ(made.code, 0) << made.err;
    const Json report = Json::parse(made.out);
    EXPECT_EQ(report["genus"], 0);
    EXPECT_EQ(report["boundary_loops"], 0);
    EXPECT_EQ(report["components"], 1);
    ASSERT_EQ(Run({"export", surface, At("cage.obj"), "--cage"}).code, 0);
    EXPECT_THAT(Content(At("cage.obj")), HasSubstr("t crease"));
    EXPECT_NEAR(VolumeOf(triangles), volume, 1e-5);
    EXPECT_NEAR(VolumeOf(surface), volume, 2e-3 * volume);
    const Ended near = Run({"compare", triangles, surface, "--max-rms", "5e-5"});
    EXPECT_EQ(near.code, 0) << near.out;
    EXPECT_EQ(Run({"verify", surface, triangles}).code, 0);
  }
}

TEST_F(CombineTest, SurfacesAreTakenAtTheirFinestLevel) {
  WriteSurface("a.dss");
  const Ended made = Run({"combine", At("a.dss"), At("b.obj"), "--difference", "-o", At("c.stl"),
                          "--keep-dss", "--unit", "mm", "--quiet"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("without"));
  EXPECT_LE(WidestLine(made.out), 80u);
  EXPECT_NEAR(VolumeOf(At("c.dss")), 7, 0.02);
  EXPECT_NEAR(VolumeOf(At("c.stl")), 7, 0.02);
}

TEST_F(CombineTest, SaysWhatIsMissing) {
  EXPECT_EQ(Run({"combine", At("a.obj"), "--union", "-o", At("c.dss")}).code, 2);
  const Ended operation = Run({"combine", At("a.obj"), At("b.obj"), "-o", At("c.dss")});
  EXPECT_EQ(operation.code, 2);
  EXPECT_THAT(operation.err, HasSubstr("--difference"));
  EXPECT_EQ(
      Run({"combine", At("a.obj"), At("b.obj"), "--union", "--difference", "-o", At("c.dss")}).code,
      2);
}

TEST_F(CombineTest, NothingLeftOrNextToNothingIsAnError) {
  const Ended made =
      Run({"combine", At("a.obj"), At("far.obj"), "--intersection", "-o", At("c.dss")});
  EXPECT_EQ(made.code, 3);
  EXPECT_THAT(made.err, HasSubstr("nothing is left"));
  EXPECT_FALSE(fs::exists(At("c.dss")));
  EXPECT_EQ(Run({"combine", At("a.obj"), At("a.obj"), "--difference", "-o", At("c.dss")}).code, 3);
  WriteBox("deep.obj", 0.5, 0.5, 2 - 2e-9, 1);
  const Ended thin =
      Run({"combine", At("a.obj"), At("deep.obj"), "--intersection", "-o", At("c.dss")});
  EXPECT_EQ(thin.code, 3);
  EXPECT_THAT(thin.err, HasSubstr("thick in the mean"));
  // Beside a corner that is thick enough.
  WriteBox("corner.obj", -1.5, -1.5, -1.5, 2);
  std::ofstream(At("two.obj")) << Content(At("deep.obj")) << Content(At("corner.obj"));
  const Ended beside =
      Run({"combine", At("a.obj"), At("two.obj"), "--intersection", "-o", At("c.dss")});
  EXPECT_EQ(beside.code, 3);
  EXPECT_THAT(beside.err, HasSubstr("a part of what is left, around (1, 1"));
  EXPECT_FALSE(fs::exists(At("c.dss")));
}

TEST_F(CombineTest, OpenShapesAndPointsAreRefused) {
  std::ofstream(At("open.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 4\nf 2 3 4\n";
  const Ended open = Run({"combine", At("a.obj"), At("open.obj"), "--union", "-o", At("c.dss")});
  EXPECT_EQ(open.code, 3);
  EXPECT_THAT(open.err, HasSubstr("the second shape is open"));
  std::ofstream(At("points.xyz")) << "0 0 0\n1 0 0\n0 1 0\n";
  const Ended points =
      Run({"combine", At("a.obj"), At("points.xyz"), "--union", "-o", At("c.dss")});
  EXPECT_EQ(points.code, 3);
  EXPECT_THAT(points.err, HasSubstr("rilievo reconstruct"));
}

TEST_F(CombineTest, NeverWritesOverAnInput) {
  const std::string before = Content(At("a.obj"));
  EXPECT_EQ(Run({"combine", At("a.obj"), At("b.obj"), "--union", "-o", At("a.obj")}).code, 2);
  EXPECT_EQ(Content(At("a.obj")), before);
}

TEST_F(CombineTest, BothHaveOneUnit) {
  WriteSurface("mm.dss");
  const Ended differ = Run({"combine", At("mm.dss"), At("b.obj"), "--union", "-o", At("c.dss")});
  EXPECT_EQ(differ.code, 3);
  EXPECT_THAT(differ.err, HasSubstr("--unit"));
  const Ended said = Run({"combine", At("mm.dss"), At("b.obj"), "--union", "-o", At("c.dss"),
                          "--unit", "mm", "--max-level", "2", "--quiet"});
  EXPECT_EQ(said.code, 0) << said.err;
  EXPECT_THAT(Run({"info", At("c.dss"), "--json"}).out, HasSubstr("mm"));
}

}  // namespace
}  // namespace rilievo
