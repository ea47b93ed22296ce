// `rilievo deform --level`: the vertices of a level are moved, finer detail rides along.
#include <cmath>

#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class DeformLevelTest : public ProgramFixture {
 protected:
  void SetUp() override {
    fs::copy_file(RILIEVO_GOLDEN_FOLDER "/colored_torus_in_groups_v3.dss", At("a.dss"));
    ASSERT_EQ(Run({"export", At("a.dss"), At("level1.obj"), "--level", "1"}).code, 0);
  }

  // The mesh with each z moved.
  void WriteMoved(const std::string& name) const {
    std::istringstream in(Content(At("level1.obj")));
    std::ofstream out(At(name));
    out.precision(17);
    for (std::string line; std::getline(in, line);) {
      double x = 0, y = 0, z = 0;
      if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) == 3) {
        out << "v " << x << ' ' << y << ' ' << z + 5 * std::sin(x / 20) << '\n';
      } else if (line[0] == 'f') {
        out << line << '\n';
      }
    }
  }
};

TEST_F(DeformLevelTest, AnUnchangedMeshGivesTheSameFile) {
  const Ended made =
      Run({"deform", At("a.dss"), "--cage", At("level1.obj"), "--level", "1", "-o", At("b.dss")});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(Content(At("b.dss")), Content(At("a.dss")));
}

TEST_F(DeformLevelTest, TheLevelGoesWhereItIsPut) {
  WriteMoved("moved.obj");
  const Ended made = Run({"deform", At("a.dss"), "--cage", At("moved.obj"), "--level", "1", "-o",
                          At("b.dss"), "--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  const double missed = Json::parse(made.out)["missed_max"];
  ASSERT_EQ(Run({"export", At("b.dss"), At("b.obj"), "--level", "1"}).code, 0);
  std::istringstream expected(Content(At("moved.obj"))), found(Content(At("b.obj")));
  double apart = 0;
  std::string left, right;
  while (std::getline(expected, left) && std::getline(found, right)) {
    double a[3], b[3];
    if (std::sscanf(left.c_str(), "v %lf %lf %lf", &a[0], &a[1], &a[2]) != 3) break;
    ASSERT_EQ(std::sscanf(right.c_str(), "v %lf %lf %lf", &b[0], &b[1], &b[2]), 3);
    apart = std::max(apart, std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]));
  }
  // Heights are coded to some 2e-5 of the diagonal, 123.
  EXPECT_LE(apart, missed + 0.02);
  EXPECT_LT(missed, 0.5) << "a tenth of the moves";
  EXPECT_THAT(Run({"info", At("b.dss")}).out, HasSubstr("colours"));
}

TEST_F(DeformLevelTest, RefusesOtherLevelsAndMeshes) {
  const auto refused = [&](const std::vector<std::string>& more, int code) {
    std::vector<std::string> words = {"deform",         At("a.dss"), "--cage",
                                      At("level1.obj"), "-o",        At("b.dss")};
    words.insert(words.end(), more.begin(), more.end());
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, code);
    return ended.err;
  };
  EXPECT_THAT(refused({"--level", "0"}, 3), HasSubstr("level1.obj: the cage has"));
  EXPECT_THAT(refused({"--level", "7"}, 3), HasSubstr("level is 7"));
  EXPECT_THAT(refused({"--level", "1", "--crease-sharpness", "2"}, 2), HasSubstr("control mesh"));
  EXPECT_THAT(refused({"--level", "1", "--cage", At("a.dss")}, 2), HasSubstr("takes one --cage"));
}

}  // namespace
}  // namespace rilievo
