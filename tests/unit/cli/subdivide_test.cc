// `rilievo subdivide`: meshes refined by the schemes of the literature.
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class SubdivideTest : public ProgramFixture {
 protected:
  void SetUp() override {
    const std::string corners =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n";
    std::ofstream(At("quads.obj"))
        << corners << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    std::ofstream(At("tagged.obj"))
        << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 "
           "4\nf 3 1 4\nt crease 2/1/0 1 0 10\nt corner 3/1/0 0 1 3 10\n";
  }

  Json Subdivide(const std::string& input, const std::string& scheme, const std::string& levels,
                 const std::string& output) const {
    const Ended made = Run({"subdivide", At(input), "--scheme", scheme, "--levels", levels, "-o",
                            At(output), "--json"});
    EXPECT_EQ(made.code, 0) << made.err;
    return Json::parse(made.out);
  }
};

TEST_F(SubdivideTest, PolygonsStayPolygons) {
  const Json once = Subdivide("quads.obj", "catmull-clark", "1", "once.obj");
  EXPECT_EQ(once["vertices"], 26);
  EXPECT_EQ(once["faces"], 24);
  // Once more from the file is the same as twice at once, but for the digits of text.
  EXPECT_EQ(Subdivide("once.obj", "catmull-clark", "1", "again.obj")["faces"], 96);
  Subdivide("quads.obj", "catmull-clark", "2", "twice.obj");
  EXPECT_EQ(Content(At("again.obj")).substr(0, 2000), Content(At("twice.obj")).substr(0, 2000));
  EXPECT_EQ(Subdivide("quads.obj", "doo-sabin", "1", "corners.obj")["faces"], 26);
  EXPECT_EQ(Subdivide("corners.obj", "doo-sabin", "1", "finer.obj")["vertices"], 96);
  const Json measured = Json::parse(Run({"measure", At("twice.obj"), "--json"}).out);
  EXPECT_GT(measured["volume"], 0.3);
  EXPECT_LT(measured["volume"], 0.5);
}

TEST_F(SubdivideTest, OtherFormatsGetTriangles) {
  Subdivide("quads.obj", "catmull-clark", "2", "fine.ply");
  Subdivide("quads.obj", "catmull-clark", "2", "fine.obj");
  EXPECT_NEAR(Json::parse(Run({"measure", At("fine.ply"), "--json"}).out)["volume"],
              Json::parse(Run({"measure", At("fine.obj"), "--json"}).out)["volume"], 1e-6);
}

TEST_F(SubdivideTest, LoopKnowsCreases) {
  Subdivide("tagged.obj", "loop", "2", "sharp.obj");
  const std::string text = Content(At("sharp.obj"));
  EXPECT_THAT(text, HasSubstr("v 0 0 1\n"));    // the corner stays
  EXPECT_THAT(text, HasSubstr("v 0.5 0 0\n"));  // the middle of the crease too
  const Ended other = Run({"subdivide", At("tagged.obj"), "--scheme", "sqrt3", "-o", At("x.obj")});
  EXPECT_EQ(other.code, 3);
  EXPECT_THAT(other.err, HasSubstr("knows no creases"));
}

TEST_F(SubdivideTest, CreasesGoOn) {
  std::ofstream(At("soft.obj")) << Content(At("tagged.obj")) << "t crease 2/1/0 2 3 1.5\n";
  Subdivide("soft.obj", "loop", "1", "once.obj");
  const std::string once = Content(At("once.obj"));
  EXPECT_THAT(once, HasSubstr(" 10\nt crease"));
  EXPECT_THAT(once, HasSubstr(" 0.5\n"));
  EXPECT_THAT(once, HasSubstr("t corner 1/1/0 3 10\n"));
  Subdivide("once.obj", "loop", "1", "again.obj");
  Subdivide("soft.obj", "loop", "2", "twice.obj");
  EXPECT_EQ(Content(At("again.obj")), Content(At("twice.obj")));
  EXPECT_THAT(Content(At("twice.obj")), Not(HasSubstr(" 0.5\nt")));
}

TEST_F(SubdivideTest, SaysWhatIsWrong) {
  EXPECT_EQ(Run({"subdivide", At("quads.obj"), "-o", At("quads.obj")}).code, 2);
  EXPECT_EQ(Run({"subdivide", At("quads.obj"), "--scheme", "midpoint", "-o", At("x.obj")}).code, 2);
  EXPECT_EQ(Run({"subdivide", At("quads.obj"), "--levels", "9", "-o", At("x.obj")}).code, 2);
  {
    // A strip, of which 8 levels would be too many.
    std::ofstream strip(At("many.obj"));
    for (int i = 0; i < 2002; ++i) strip << "v " << i << ' ' << i % 2 << " 0\n";
    for (int i = 1; i <= 2000; ++i) {
      strip << "f " << i << ' ' << i + 1 + (i % 2 == 0) << ' ' << i + 2 - (i % 2 == 0) << '\n';
    }
  }
  const Ended many = Run({"subdivide", At("many.obj"), "--levels", "8", "-o", At("x.obj")});
  EXPECT_EQ(many.code, 2);
  EXPECT_THAT(many.err, HasSubstr("at most"));
  const Ended quads = Run({"subdivide", At("quads.obj"), "-o", At("x.obj")});
  EXPECT_EQ(quads.code, 3);
  EXPECT_THAT(quads.err, HasSubstr("loop takes triangles"));
  std::ofstream(At("points.xyz")) << "0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(Run({"subdivide", At("points.xyz"), "-o", At("x.obj")}).code, 3);
  EXPECT_EQ(Run({"subdivide", At("quads.obj"), "--scheme", "doo-sabin", "-o", At("x.dss")}).code,
            2);
}

}  // namespace
}  // namespace rilievo
