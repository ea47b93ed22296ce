// Files that `rilievo export` writes besides plain meshes: compressed GLB, 3MF, 3D Tiles.
#include <Eigen/Geometry>
#include <set>

#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class ExportTest : public ProgramFixture {
 protected:
  ExportTest() {
    EXPECT_EQ(Run({"simulate", "star", "-o", At("scan.ply"), "--points", "4000"}).code, 0);
    EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
  }

  Json Exported(std::vector<std::string> words) const {
    words.insert(words.begin(), {"export", At("a.dss")});
    words.push_back("--json");
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return Json::parse(ended.out);
  }
};

TEST_F(ExportTest, CompressesGlb) {
  const Json plain = Exported({At("plain.glb")});
  EXPECT_EQ(Exported({At("small.glb"), "--compress"})["faces"], plain["faces"]);
  EXPECT_LT(5 * fs::file_size(At("small.glb")), fs::file_size(At("plain.glb")));
  EXPECT_THAT(Content(At("small.glb")), HasSubstr("EXT_meshopt_compression"));
  // It comes back as it was, but for the steps of its coordinates.
  const Ended back = Run({"compare", At("small.glb"), At("plain.glb"), "--json"});
  ASSERT_EQ(back.code, 0) << back.err;
  EXPECT_LT(Json::parse(back.out)["rms_percent"], 1e-3) << back.out;
}

TEST_F(ExportTest, WritesTilesIntoAFolder) {
  const Json facts = Exported({At("tiles/"), "--compress"});
  std::set<std::string> named, there;
  const auto collect = [&](const auto& self, const Json& tile) -> void {
    named.insert(tile["content"]["uri"].get<std::string>());
    for (const Json& child : tile.value("children", Json::array())) self(self, child);
  };
  collect(collect, Json::parse(Content(At("tiles/tileset.json")))["root"]);
  for (const auto& entry : fs::directory_iterator(At("tiles"))) {
    if (entry.path().extension() == ".glb") there.insert(entry.path().filename().string());
  }
  EXPECT_EQ(named, there);
  EXPECT_EQ(facts["tiles"], there.size());
  // A folder that is there needs no slash.
  EXPECT_LT(Exported({At("tiles"), "--level", "0"})["tiles"], facts["tiles"]);
  const Ended shown = Run({"export", At("a.dss"), At("tiles"), "--level", "0"});
  EXPECT_THAT(shown.out, HasSubstr("tileset.json and 1"));
}

TEST_F(ExportTest, Writes3mf) {
  Exported({At("a.3mf"), "--unit", "mm", "--up", "y"});
  EXPECT_EQ(Content(At("a.3mf")).substr(0, 4), "PK\3\4");
  EXPECT_EQ(Run({"export", At("a.dss"), "-", "--format", "3mf"}).out.substr(0, 4), "PK\3\4");
}

// Of all points in space.
Eigen::AlignedBox3d BoxOfStep(const std::string& text) {
  Eigen::AlignedBox3d box;
  const std::string name = "CARTESIAN_POINT('',(";
  for (size_t at = text.find(name); at != std::string::npos; at = text.find(name, at + 1)) {
    Eigen::Vector3d point;
    const char* from = text.c_str() + at + name.size();
    int read = 0;
    for (char* end = nullptr; read < 3; from = end + 1) {
      point[read++] = std::strtod(from, &end);
      if (*end != ',') break;
    }
    if (read == 3) box.extend(point);
  }
  return box;
}

TEST_F(ExportTest, WritesStep) {
  const fs::path library =
      fs::path(RILIEVO_PROGRAM).parent_path() / "../lib/rilievo/librilievo_step.so";
  if (!fs::exists(library)) GTEST_SKIP() << "Open CASCADE is not installed";
  const Json facts = Exported({At("a.step"), "--unit", "m", "--tolerance", "0.2%"});
  EXPECT_LE(facts["error"], 0.002);
  EXPECT_EQ(facts["warnings"], Json::array());
  const std::string text = Content(At("a.step"));
  EXPECT_EQ(text.substr(0, 13), "ISO-10303-21;");
  EXPECT_THAT(text, HasSubstr("MANIFOLD_SOLID_BREP"));
  // Millimetres, z up.
  Exported({At("c.step"), "--unit", "m", "--tolerance", "0.2%", "--up", "y", "--origin", "1,0,0"});
  const Eigen::AlignedBox3d given = BoxOfStep(text), turned = BoxOfStep(Content(At("c.step")));
  const Json info = Json::parse(Run({"info", At("a.dss"), "--json"}).out);
  EXPECT_NEAR(given.diagonal().norm() / (1000 * info["frame"]["diagonal"].get<double>()), 1, 0.02);
  const Eigen::Vector3d low = given.min(), high = given.max();
  EXPECT_LT((turned.min() - Eigen::Vector3d(low.x() - 1000, -high.z(), low.y())).norm(), 1e-6);
  EXPECT_LT((turned.max() - Eigen::Vector3d(high.x() - 1000, -low.z(), high.y())).norm(), 1e-6);
  const Json far = Exported({At("b.stp"), "--tolerance", "0.2%", "--origin", "1e9,0,0"});
  EXPECT_THAT(far["warnings"][0], HasSubstr("counts as 1 mm; --unit"));
  EXPECT_THAT(far["warnings"][1],
              ::testing::AllOf(HasSubstr("STEP keeps 13 digits"), HasSubstr("--origin auto")));
  const Ended coarse = Run({"export", At("a.dss"), At("c.step"), "--tolerance", "100%"});
  EXPECT_EQ(coarse.code, 2);
  EXPECT_THAT(coarse.err, HasSubstr("--tolerance 100%"));
  const Ended piped =
      Run({"export", At("a.dss"), "-", "--format", "step", "--tolerance", "0.2%", "--unit", "m"});
  EXPECT_EQ(piped.out.substr(0, 13), "ISO-10303-21;");
}

TEST_F(ExportTest, TellsWhatStepNeeds) {
  setenv("RILIEVO_STEP", At("").c_str(), 1);
  const Ended ended = Run({"export", At("a.dss"), At("a.step")});
  unsetenv("RILIEVO_STEP");
  EXPECT_NE(ended.code, 0);
  EXPECT_THAT(ended.err, HasSubstr("rilievo-step"));
  EXPECT_FALSE(fs::exists(At("a.step")));
}

TEST_F(ExportTest, RefusesWhatDoesNotGoTogether) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{At("a.ply"), "--compress"}, "leave --compress out"},
      {{At("tiles/"), "--triangles", "100"}, "3D Tiles takes --level alone"},
      {{At("tiles/"), "--carry", At("scan.ply")}, "3D Tiles takes --level alone"},
      {{At("tiles/"), "--texture", "64"}, "only .glb can have a --texture"},
      {{At("tiles/"), "--level", "9"}, "--level 9: 3D Tiles holds heights"},
      {{At("a.step"), "--level", "2"}, ".step has patches; it takes --tolerance alone"},
      {{At("a.foo")}, "a folder (DIR/) gets 3D Tiles"},
      {{At("a.3mf"), "--carry", At("scan.ply")}, "only .ply and .glb can --carry"},
  };
  for (const auto& [options, message] : cases) {
    std::vector<std::string> words = {"export", At("a.dss")};
    words.insert(words.end(), options.begin(), options.end());
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, 2) << message;
    std::string on_one_line = ended.err;
    for (size_t at; (at = on_one_line.find("\n  ")) != std::string::npos;) {
      on_one_line.replace(at, 3, " ");
    }
    EXPECT_THAT(on_one_line, HasSubstr(message));
  }
  EXPECT_FALSE(fs::exists(At("tiles/tileset.json")));
}

}  // namespace
}  // namespace rilievo
