// `rilievo interpolate`: a smooth surface through the vertices of a mesh.
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class InterpolateTest : public ProgramFixture {
 protected:
  void SetUp() override {
    std::ofstream(At("cube.obj"))
        << "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 2 2 0\nv 0 0 2\nv 2 0 2\nv 0 2 2\nv 2 2 2\n"
           "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    std::ofstream(At("corners.xyz")) << "0 0 0\n2 0 0\n0 2 0\n2 2 0\n0 0 2\n2 0 2\n0 2 2\n2 2 2\n";
  }
};

TEST_F(InterpolateTest, VerticesLieOnTheSurface) {
  const Ended made = Run({"interpolate", At("cube.obj"), "-o", At("s.dss"), "--keep-cage",
                          At("cage.obj"), "--unit", "mm", "--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  const Json report = Json::parse(made.out);
  EXPECT_EQ(report["vertices"], 8);
  EXPECT_EQ(report["control_faces"], 48);
  EXPECT_LE(report["steps"], 60);
  const Json measured =
      Json::parse(Run({"measure", At("s.dss"), "--points", At("corners.xyz"), "--json"}).out);
  EXPECT_LT(measured["points"]["greatest"].get<double>(), 1e-7);
  EXPECT_GT(measured["points"]["least"].get<double>(), -1e-7);
  EXPECT_THAT(Run({"info", At("s.dss"), "--json"}).out, HasSubstr("mm"));
  // The cage is the control mesh.
  const Json fine = Json::parse(
      Run({"subdivide", At("cage.obj"), "--levels", "2", "-o", At("fine.obj"), "--json"}).out);
  EXPECT_EQ(fine["faces"], 48 * 16);
}

TEST_F(InterpolateTest, SaysWhatIsWrong) {
  EXPECT_EQ(Run({"interpolate", At("cube.obj"), "-o", At("cube.obj")}).code, 2);
  EXPECT_EQ(
      Run({"interpolate", At("cube.obj"), "-o", At("s.dss"), "--keep-cage", At("c.ply")}).code, 2);
  const Ended points = Run({"interpolate", At("corners.xyz"), "-o", At("s.dss")});
  EXPECT_EQ(points.code, 3);
  EXPECT_THAT(points.err, HasSubstr("without a face"));
  std::ofstream(At("bad.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n";
  EXPECT_EQ(Run({"interpolate", At("bad.obj"), "-o", At("s.dss")}).code, 3);
  EXPECT_FALSE(fs::exists(At("s.dss")));
}

}  // namespace
}  // namespace rilievo
