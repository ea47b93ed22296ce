// `rilievo deform`: an edited cage moves the surface.
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class DeformTest : public ProgramFixture {
 protected:
  void SetUp() override {
    ASSERT_EQ(Run({"simulate", "cutbox", "-o", At("scan.ply"), "--points", "8000"}).code, 0);
    ASSERT_EQ(
        Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--unit", "mm", "--quiet"}).code, 0);
    ASSERT_EQ(Run({"export", At("a.dss"), At("cage.obj"), "--cage"}).code, 0);
  }

  // The cage with twice the height, with its tags or without them.
  void WriteStretched(const std::string& name, bool with_tags) const {
    std::istringstream in(Content(At("cage.obj")));
    std::ofstream out(At(name));
    out.precision(17);
    for (std::string line; std::getline(in, line);) {
      double x = 0, y = 0, z = 0;
      if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) == 3) {
        out << "v " << x << ' ' << y << ' ' << 2 * z << '\n';
      } else if (with_tags || line.rfind("t ", 0) != 0) {
        out << line << '\n';
      }
    }
  }

  double VolumeOf(const std::string& path) const {
    return Json::parse(Run({"measure", path, "--json"}).out)["volume"];
  }
};

TEST_F(DeformTest, AnUnchangedCageGivesTheSameFile) {
  ASSERT_THAT(Content(At("cage.obj")), HasSubstr("t crease"));
  const Ended made = Run({"deform", At("a.dss"), "--cage", At("cage.obj"), "-o", At("b.dss")});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(Content(At("b.dss")), Content(At("a.dss")));
  EXPECT_THAT(made.out, HasSubstr("as the cage says"));
}

TEST_F(DeformTest, TheSurfaceFollowsTheCage) {
  WriteStretched("tall.obj", true);
  const Ended made = Run({"deform", At("a.dss"), "--cage", At("tall.obj"), "-o", At("b.dss")});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_NEAR(VolumeOf(At("b.dss")), 2 * VolumeOf(At("a.dss")), 0.01 * VolumeOf(At("a.dss")));
  EXPECT_THAT(Run({"info", At("b.dss")}).out, HasSubstr("unit        mm"));
  EXPECT_EQ(Run({"deform", At("a.dss"), "--cage", At("tall.obj"), "-o", At("b.glb")}).code, 0);
}

TEST_F(DeformTest, AChainIsReadAndATagCountsOnce) {
  std::string cage = Content(At("cage.obj"));
  cage.resize(cage.find("t crease"));
  std::istringstream first(cage.substr(cage.find("\nf ") + 3));
  std::vector<int> corners;
  for (std::string word; corners.size() < 3 && first >> word;) {
    corners.push_back(std::stoi(word) - 1);
  }
  std::ostringstream chain;
  chain << "t crease 3/2/0 " << corners[0] << ' ' << corners[1] << ' ' << corners[2] << " 2 3\n"
        << "t crease 2/1/0 " << corners[1] << ' ' << corners[0] << " 2\n";
  std::ofstream(At("chain.obj")) << cage << chain.str();
  const Ended made = Run({"deform", At("a.dss"), "--cage", At("chain.obj"), "-o", At("b.dss")});
  ASSERT_EQ(made.code, 0) << made.err;
  ASSERT_EQ(Run({"export", At("b.dss"), At("b.obj"), "--cage"}).code, 0);
  const std::string text = Content(At("b.obj"));
  EXPECT_THAT(text, AllOf(HasSubstr(" 2\n"), HasSubstr(" 3\n")));
  size_t count = 0;
  for (size_t at = 0; (at = text.find("t crease", at)) != std::string::npos; ++at) ++count;
  EXPECT_EQ(count, 2u);
}

TEST_F(DeformTest, CreasesAreThoseOfTheCageOrElseOfTheSurface) {
  WriteStretched("plain.obj", false);
  const Ended plain = Run({"deform", At("a.dss"), "--cage", At("plain.obj"), "-o", At("b.dss")});
  EXPECT_THAT(plain.out, HasSubstr("as before"));
  ASSERT_EQ(Run({"export", At("b.dss"), At("b.obj"), "--cage"}).code, 0);
  const auto tags = [&](const std::string& name) {
    const std::string text = Content(At(name));
    return text.substr(text.find("t crease"));
  };
  EXPECT_EQ(tags("b.obj"), tags("cage.obj"));
  ASSERT_EQ(Run({"deform", At("a.dss"), "--cage", At("cage.obj"), "-o", At("c.dss"),
                 "--crease-sharpness", "1.5"})
                .code,
            0);
  ASSERT_EQ(Run({"export", At("c.dss"), At("c.obj"), "--cage"}).code, 0);
  EXPECT_THAT(tags("c.obj"), HasSubstr(" 1.5\n"));
}

TEST_F(DeformTest, ACageWithoutCreasesSaysSo) {
  ASSERT_EQ(Run({"deform", At("a.dss"), "--cage", At("cage.obj"), "-o", At("b.dss"),
                 "--crease-sharpness", "0"})
                .code,
            0);
  ASSERT_EQ(Run({"export", At("b.dss"), At("b.obj"), "--cage"}).code, 0);
  const Ended made = Run({"deform", At("a.dss"), "--cage", At("b.obj"), "-o", At("c.dss")});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(Content(At("c.dss")), Content(At("b.dss")));
}

TEST_F(DeformTest, RefusesOtherMeshesAndWrongTags) {
  std::ofstream(At("tri.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const Ended other = Run({"deform", At("a.dss"), "--cage", At("tri.obj"), "-o", At("b.dss")});
  EXPECT_EQ(other.code, 3);
  EXPECT_THAT(other.err, HasSubstr("vertices may move"));
  std::ofstream(At("tag.obj")) << Content(At("cage.obj")) << "t crease 2/1/0 0 999999 3\n";
  const Ended tag = Run({"deform", At("a.dss"), "--cage", At("tag.obj"), "-o", At("b.dss")});
  EXPECT_EQ(tag.code, 3);
  EXPECT_THAT(tag.err, HasSubstr("a tag names vertex 999999"));
  std::ofstream(At("tag.obj")) << Content(At("cage.obj")) << "t crease 2/1/0 0 -1 3\n";
  const Ended below = Run({"deform", At("a.dss"), "--cage", At("tag.obj"), "-o", At("b.dss")});
  EXPECT_EQ(below.code, 3);
  EXPECT_THAT(below.err, HasSubstr("below 0"));
  ASSERT_EQ(Run({"export", At("a.dss"), At("cage.glb"), "--cage"}).code, 0);
  const Ended glb = Run({"deform", At("a.dss"), "--cage", At("cage.glb"), "-o", At("b.dss")});
  EXPECT_EQ(glb.code, 2);
  EXPECT_THAT(glb.err, HasSubstr("as OBJ or PLY"));
  EXPECT_EQ(Run({"deform", At("a.dss"), "--cage", At("cage.obj"), "-o", At("cage.obj")}).code, 2);
  EXPECT_FALSE(fs::exists(At("b.dss")));
}

}  // namespace
}  // namespace rilievo
