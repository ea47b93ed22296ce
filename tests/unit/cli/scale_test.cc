// `rilievo scale`: a new box, and features that keep their shape.
#include <array>
#include <cmath>

#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class ScaleTest : public ProgramFixture {
 protected:
  // A bump on a sheet that bends up at its border.
  void SetUp() override {
    std::ofstream out(At("sheet.obj"));
    for (int y = 0; y <= 30; ++y) {
      for (int x = 0; x <= 30; ++x) {
        const double u = x / 15.0 - 1, v = y / 15.0 - 1;
        out << "v " << 10 * u << ' ' << 10 * v << ' '
            << u * u * u * u + v * v * v * v + 2 * std::exp(-20 * (u * u + v * v)) << '\n';
      }
    }
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 30; ++x) {
        const int v = 31 * y + x + 1;
        out << "f " << v << ' ' << v + 1 << ' ' << v + 32 << ' ' << v + 31 << '\n';
      }
    }
    out.close();
    ASSERT_EQ(Run({"convert", At("sheet.obj"), "-o", At("sheet.dss"), "--control-faces", "900",
                   "--max-level", "1", "--quiet"})
                  .code,
              0);
  }

  // Of the box of the vertices.
  static std::array<double, 3> SidesOf(const std::string& obj) {
    std::array<double, 3> low, high;
    low.fill(1e9);
    high.fill(-1e9);
    std::ifstream in(obj);
    std::string keyword;
    for (std::string line; std::getline(in, line);) {
      std::istringstream words(line);
      if (!(words >> keyword) || keyword != "v") continue;
      for (size_t axis = 0; axis < 3; ++axis) {
        double x = 0;
        words >> x;
        low[axis] = std::min(low[axis], x);
        high[axis] = std::max(high[axis], x);
      }
    }
    return {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
  }

  void WriteBores(const std::string& text) const { std::ofstream(At("bores.json")) << text; }
};

TEST_F(ScaleTest, TheBoxIsMetAndTheBumpKeepsItsShape) {
  WriteBores(R"([{"from": [0, 0, -9], "to": [0, 0, 9], "radius": 2}])");
  const Ended made = Run({"scale", At("sheet.dss"), "--to", "30,22,3", "--keep", At("bores.json"),
                          "-o", At("t.dss"), "--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  const Json report = Json::parse(made.out);
  EXPECT_GT(report["held_control_points"], 10);
  ASSERT_EQ(Run({"export", At("t.dss"), At("t.obj")}).code, 0);
  const std::array<double, 3> sides = SidesOf(At("t.obj"));
  const std::array expected = {30.0, 22.0, 3.0};
  for (size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(sides[axis], expected[axis], 1e-5);
}

TEST_F(ScaleTest, SaysWhatIsWrong) {
  const auto scale = [&](const std::string& to) {
    return Run(
        {"scale", At("sheet.dss"), "--to", to, "--keep", At("bores.json"), "-o", At("t.dss")});
  };
  WriteBores("[]");
  EXPECT_EQ(scale("1,2").code, 2);
  EXPECT_EQ(scale("1,2,-3").code, 2);
  for (const char* extreme : {"1e300,1,1", "1e-9,1,1"}) {
    const Ended made = scale(extreme);
    EXPECT_EQ(made.code, 3) << extreme;
    EXPECT_THAT(made.err, HasSubstr("size: along x the box is"));
  }
  const std::pair<const char*, const char*> cases[] = {
      {"{", "no list in JSON"},
      {"[7]", "feature 1 is no object"},
      {R"([{"from": [0, 0, 0], "to": [0, 0], "radius": 2}])", "feature 1 lacks"},
      {R"([{"from": [0, 0, 0], "to": [0, 0, 1], "radius": 2, "diameter": 4}])", "has 'diameter'"},
      {R"([{"from": [0, 0, 0], "to": [0, 0, 0], "radius": 2}])", "feature 1: two different"},
      {R"([{"from": [0, 0, 50], "to": [0, 0, 60], "radius": 2}])", "holds no part"}};
  for (const auto& [text, words] : cases) {
    WriteBores(text);
    const Ended made = scale("30,20,3");
    EXPECT_EQ(made.code, 3) << text;
    EXPECT_THAT(made.err, HasSubstr(words));
  }
  EXPECT_EQ(Run({"scale", At("sheet.dss"), "--to", "1,2,3", "-o", At("sheet.dss")}).code, 2);
  EXPECT_FALSE(fs::exists(At("t.dss")));
}

}  // namespace
}  // namespace rilievo
