// `rilievo deform --level`: the vertices of a level are moved, finer detail rides along.
#include <cmath>

#include "core/codec/container/open_dss.h"
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
  void WriteMoved(const std::string& name, double by = 5) const {
    std::istringstream in(Content(At("level1.obj")));
    std::ofstream out(At(name));
    out.precision(17);
    for (std::string line; std::getline(in, line);) {
      double x = 0, y = 0, z = 0;
      if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) == 3) {
        out << "v " << x << ' ' << y << ' ' << z + by * std::sin(x / 20) << '\n';
      } else if (line[0] == 'f') {
        out << line << '\n';
      }
    }
  }

  // The largest distance between vertices of the same number.
  double Apart(const std::string& one, const std::string& other) const {
    std::istringstream expected(Content(At(one))), found(Content(At(other)));
    double apart = 0;
    std::string left, right;
    while (std::getline(expected, left) && std::getline(found, right)) {
      double a[3], b[3];
      if (std::sscanf(left.c_str(), "v %lf %lf %lf", &a[0], &a[1], &a[2]) != 3) break;
      EXPECT_EQ(std::sscanf(right.c_str(), "v %lf %lf %lf", &b[0], &b[1], &b[2]), 3);
      apart = std::max(apart, std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]));
    }
    return apart;
  }
};

TEST_F(DeformLevelTest, AnUnchangedMeshGivesTheSameFile) {
  const Ended made =
      Run({"deform", At("a.dss"), "--cage", At("level1.obj"), "--level", "1", "-o", At("b.dss")});
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(Content(At("b.dss")), Content(At("a.dss")));
}

TEST_F(DeformLevelTest, SoDoesOneThatWentThroughFloats) {
  fs::copy_file(RILIEVO_GOLDEN_FOLDER "/genus2_plain_levels_v3.dss", At("a.dss"),
                fs::copy_options::overwrite_existing);
  ASSERT_EQ(Run({"export", At("a.dss"), At("level1.ply"), "--level", "1"}).code, 0);
  ASSERT_EQ(Run({"export", At("a.dss"), At("cage.ply"), "--cage"}).code, 0);
  ASSERT_THAT(Content(At("cage.ply")), HasSubstr("property float x"));
  for (const std::vector<std::string>& cage :
       {std::vector<std::string>{At("level1.ply"), "--level", "1"}, {At("cage.ply")}}) {
    std::vector<std::string> words = {"deform", At("a.dss"), "-o", At("b.dss"), "--cage"};
    words.insert(words.end(), cage.begin(), cage.end());
    EXPECT_EQ(Run(words).code, 0);
    EXPECT_EQ(Content(At("b.dss")), Content(At("a.dss")));
  }
}

TEST_F(DeformLevelTest, GroupsStayAndManyEditsDoNotMakeAFileGrow) {
  const auto groups = [&] {
    const auto file = Content(At("a.dss"));
    return OpenDss({reinterpret_cast<const uint8_t*>(file.data()), file.size()}, false)
        ->header.group_limit;
  };
  const int before = groups();
  ASSERT_GT(before, 0);
  size_t bytes = 0;
  for (int edit = 0; edit < 5; ++edit) {
    ASSERT_EQ(Run({"export", At("a.dss"), At("level1.obj"), "--level", "1"}).code, 0);
    WriteMoved("moved.obj", edit % 2 == 0 ? 5 : -5);
    ASSERT_EQ(
        Run({"deform", At("a.dss"), "--cage", At("moved.obj"), "--level", "1", "-o", At("b.dss")})
            .code,
        0);
    fs::rename(At("b.dss"), At("a.dss"));
    if (edit == 0) bytes = Content(At("a.dss")).size();
  }
  EXPECT_EQ(groups(), before);
  EXPECT_LT(Content(At("a.dss")).size(), bytes + bytes / 20);
}

TEST_F(DeformLevelTest, FilledHeightsGoWhereTheyArePut) {
  // A unit sphere without a cap, a spiral of points with normals.
  std::ofstream holed(At("holed.xyz"));
  constexpr int kPoints = 6000;
  for (int i = 0; i < kPoints; ++i) {
    const double z = -1 + (2.0 * i + 1) / kPoints, r = std::sqrt(1 - z * z), turn = 2.399963 * i;
    if (z > 0.7) break;
    for (int twice = 0; twice < 2; ++twice) {
      holed << r * std::cos(turn) << ' ' << r * std::sin(turn) << ' ' << z << (twice ? '\n' : ' ');
    }
  }
  holed.close();
  ASSERT_EQ(Run({"reconstruct", At("holed.xyz"), "-o", At("a.dss"), "--close-holes-below", "10u",
                 "--max-level", "2", "--quiet"})
                .code,
            0);
  ASSERT_EQ(Run({"export", At("a.dss"), At("level1.obj"), "--level", "2"}).code, 0);
  std::istringstream in(Content(At("level1.obj")));
  std::ofstream out(At("moved.obj"));
  out.precision(17);
  for (std::string line; std::getline(in, line);) {
    double x = 0, y = 0, z = 0;
    if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) == 3) {
      if (z > 0.75) z += 0.15 * std::sin(12 * x);
      out << "v " << x << ' ' << y << ' ' << z << '\n';
    } else if (line[0] == 'f') {
      out << line << '\n';
    }
  }
  out.close();
  const Ended made = Run({"deform", At("a.dss"), "--cage", At("moved.obj"), "--level", "2", "-o",
                          At("b.dss"), "--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  const double missed = Json::parse(made.out)["missed_max"];
  ASSERT_EQ(Run({"export", At("b.dss"), At("b.obj"), "--level", "2"}).code, 0);
  EXPECT_NEAR(Apart("moved.obj", "b.obj"), missed, 1e-6);
  EXPECT_LT(missed, 0.11) << "the part of the moves along the surface";
}

TEST_F(DeformLevelTest, TheLevelGoesWhereItIsPut) {
  WriteMoved("moved.obj");
  const Ended made = Run({"deform", At("a.dss"), "--cage", At("moved.obj"), "--level", "1", "-o",
                          At("b.dss"), "--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  const double missed = Json::parse(made.out)["missed_max"];
  ASSERT_EQ(Run({"export", At("b.dss"), At("b.obj"), "--level", "1"}).code, 0);
  EXPECT_NEAR(Apart("moved.obj", "b.obj"), missed, 1e-6);
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
  EXPECT_THAT(refused({"--level", "7"}, 2), HasSubstr("--level 7: "));
  fs::copy_file(At("a.dss"), At("level1.obj.dss"));
  const Ended cage = Run(
      {"deform", At("a.dss"), "--cage", At("level1.obj.dss"), "--level", "0", "-o", At("b.dss")});
  EXPECT_EQ(cage.code, 2);
  EXPECT_THAT(cage.err, AllOf(HasSubstr("level1.obj.dss"), HasSubstr("control")));
  EXPECT_THAT(refused({"--level", "1", "--crease-sharpness", "2"}, 2), HasSubstr("control mesh"));
  EXPECT_THAT(refused({"--level", "1", "--cage", At("a.dss")}, 2), HasSubstr("takes one --cage"));
}

}  // namespace
}  // namespace rilievo
