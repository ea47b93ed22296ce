// A GLB as the mesh that a command is given.
#include <string>

#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class GlbInputTest : public ProgramFixture {
 protected:
  GlbInputTest() {
    EXPECT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "3000"}).code, 0);
    EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
    for (const char* name : {"a.glb", "a.stl"}) {
      EXPECT_EQ(Run({"export", At("a.dss"), At(name)}).code, 0);
    }
  }
};

TEST_F(GlbInputTest, IsMeasuredAndCompared) {
  const Ended measured = Run({"measure", At("a.glb"), "--json"});
  ASSERT_EQ(measured.code, 0) << measured.err;
  const Json glb = Json::parse(measured.out);
  const Json stl = Json::parse(Run({"measure", At("a.stl"), "--json"}).out);
  EXPECT_TRUE(glb["closed"].get<bool>());
  EXPECT_NEAR(glb["volume"].get<double>() / stl["volume"].get<double>(), 1, 1e-5);
  const Ended compared = Run({"compare", At("a.glb"), At("a.glb"), "--json"});
  EXPECT_EQ(compared.code, 0) << compared.err;
  EXPECT_EQ(Run({"view", At("a.glb"), "-o", At("a.png")}).code, 0);
}

TEST_F(GlbInputTest, IsNoScanUnlessItsPointsAloneAreWanted) {
  const Ended refused = Run({"reconstruct", At("a.glb"), "-o", At("b.dss")});
  EXPECT_EQ(refused.code, 3);
  EXPECT_THAT(refused.err, HasSubstr("a mesh of"));
  EXPECT_EQ(Run({"reconstruct", At("a.glb"), "-o", At("b.dss"), "--points-only"}).code, 0);
  const Json info = Json::parse(Run({"info", At("b.dss"), "--json"}).out);
  EXPECT_EQ(info["place"]["up"], "y");
}

TEST_F(GlbInputTest, HasItsPointsInPartsToo) {
  EXPECT_EQ(Run({"export", At("a.dss"), At("a.ply")}).code, 0);
  for (const char* name : {"a.glb", "a.stl", "a.ply"}) {
    const auto reconstruct = [&](std::vector<std::string> more) {
      more.insert(more.begin(), {"reconstruct", At(name), "-o", At("b.dss")});
      return Run(more);
    };
    const std::string whole = reconstruct({}).err, parts = reconstruct({"--parts"}).err;
    EXPECT_THAT(parts, ::testing::ContainsRegex("[1-9][0-9,]* vertices"));
    EXPECT_EQ(parts, whole) << name;
    const Ended taken = reconstruct({"--parts", "--points-only"});
    EXPECT_EQ(taken.code, 0) << taken.err;
  }
}

}  // namespace
}  // namespace rilievo
