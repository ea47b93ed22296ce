// `rilievo deform` with several cages: poses that share the heights, meshes, and a clip.
#include "client/cli/deform_frames.h"

#include <Eigen/Core>
#include <cmath>

#include "tests/unit/cli/program_fixture.h"
#include "tests/unit/formats/glb_parts.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class DeformFramesTest : public ProgramFixture {
 protected:
  void SetUp() override {
    fs::copy_file(RILIEVO_GOLDEN_FOLDER "/colored_torus_in_groups_v3.dss", At("a.dss"));
    ASSERT_EQ(Run({"export", At("a.dss"), At("cage.obj"), "--cage"}).code, 0);
    for (int frame = 0; frame < 3; ++frame) WriteBent(frame);
  }

  std::string Frame(int frame) const { return At("f" + std::to_string(frame) + ".obj"); }

  // The cage, bent the more the later.
  void WriteBent(int frame) const {
    std::istringstream in(Content(At("cage.obj")));
    std::ofstream out(Frame(frame));
    out.precision(17);
    for (std::string line; std::getline(in, line);) {
      double x = 0, y = 0, z = 0;
      if (std::sscanf(line.c_str(), "v %lf %lf %lf", &x, &y, &z) == 3) {
        out << "v " << x << ' ' << y << ' ' << z + 5 * frame * std::sin(x) << '\n';
      } else {
        out << line << '\n';
      }
    }
  }

  Ended Deform(const std::string& output, std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {"deform", At("a.dss"), "--cage", Frame(0),
                                      Frame(1), Frame(2),    "-o",     At(output)};
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  }
};

// One column a vertex, about the mesh's node.
Eigen::Matrix3Xf Positions(const testing::GlbParts& glb, const Json& attributes) {
  const Json& accessor = glb.json["accessors"][attributes["POSITION"].get<size_t>()];
  const Json& view = glb.json["bufferViews"][accessor["bufferView"].get<size_t>()];
  const size_t begin =
      view.value("byteOffset", size_t{0}) + accessor.value("byteOffset", size_t{0});
  const size_t stride = view.value("byteStride", 3 * sizeof(float));
  Eigen::Matrix3Xf positions(3, accessor["count"].get<Eigen::Index>());
  for (Eigen::Index i = 0; i < positions.size(); ++i) {
    const auto vertex = static_cast<size_t>(i / 3), axis = static_cast<size_t>(i % 3);
    positions.data()[i] =
        testing::LoadAt<float>(glb.binary, begin + vertex * stride + axis * sizeof(float));
  }
  return positions;
}

Eigen::Vector3d TranslationOf(const testing::GlbParts& glb) {
  const Json& axes = glb.json["nodes"][1]["translation"];
  return {axes[0].get<double>(), axes[1].get<double>(), axes[2].get<double>()};
}

TEST_F(DeformFramesTest, PosesCostTheirCagesAndTakeTheHeightsOfTheSurface) {
  const Ended made = Deform("out/", {"--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(Json::parse(made.out)["frames"], 3);
  const std::string pose = Content(At("out/f2.pose.dss"));
  EXPECT_LT(3 * pose.size(), Content(At("a.dss")).size());
  for (const std::string& cage : {Frame(2), At("out/f2.pose.dss")}) {
    ASSERT_EQ(Run({"deform", At("a.dss"), "--cage", cage, "-o", At("full.dss")}).code, 0);
    ASSERT_EQ(Run({"deform", At("a.dss"), "--cage", Frame(2), "-o", At("direct.dss")}).code, 0);
    EXPECT_EQ(Content(At("full.dss")), Content(At("direct.dss")));
  }
  EXPECT_EQ(Content(At("full.dss")).substr(0, pose.size()), pose);
}

TEST_F(DeformFramesTest, AFolderOfSurfacesOrMeshes) {
  ASSERT_EQ(Deform("full/", {"--frames", "dss"}).code, 0);
  ASSERT_EQ(Deform("meshes/", {"--frames", "obj"}).code, 0);
  EXPECT_EQ(Content(At("full/f0.dss")), Content(At("a.dss")));
  const Ended compared =
      Run({"compare", At("full/f1.dss"), At("meshes/f1.obj"), "--max-distance", "1e-6"});
  EXPECT_EQ(compared.code, 0) << compared.out << compared.err;
}

TEST_F(DeformFramesTest, AClipGoesThroughAllCages) {
  const Ended made = Deform("clip.glb", {"--fps", "10"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("frames"));
  const std::string glb = Content(At("clip.glb"));
  const testing::GlbParts clip = testing::TakeGlbApart(glb);
  const Json& json = clip.json;
  const Json& primitive = json["meshes"][0]["primitives"][0];
  ASSERT_EQ(primitive["targets"].size(), 2u);
  const Json& sampler = json["animations"][0]["samplers"][0];
  const Json& times = json["accessors"][sampler["input"].get<size_t>()];
  EXPECT_EQ(times["count"], 3);
  EXPECT_NEAR(times["max"][0].get<double>(), 0.2, 1e-6);
  EXPECT_EQ(json["accessors"][sampler["output"].get<size_t>()]["count"], 6);
  // The first frame and what the last adds are the last.
  ASSERT_EQ(Run({"deform", At("a.dss"), "--cage", Frame(2), "-o", At("last.glb")}).code, 0);
  const testing::GlbParts last = testing::TakeGlbApart(Content(At("last.glb")));
  const Eigen::Matrix3Xf moved =
      Positions(clip, primitive["attributes"]) + Positions(clip, primitive["targets"][1]);
  const Eigen::Matrix3Xf expected =
      Positions(last, last.json["meshes"][0]["primitives"][0]["attributes"]);
  ASSERT_EQ(moved.cols(), expected.cols());
  const Eigen::Vector3d apart = TranslationOf(clip) - TranslationOf(last);
  const Eigen::Matrix3Xd off = (moved - expected).cast<double>().colwise() + apart;
  EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-5 * (expected.maxCoeff() - expected.minCoeff()));
}

TEST_F(DeformFramesTest, AClipIsNoLargerThanItsFormat) {
  constexpr int64_t kVertices = 1000000;
  EXPECT_TRUE(CheckClipSize("a.glb", 178, kVertices).ok());
  const absl::Status status = CheckClipSize("a.glb", 179, kVertices);
  EXPECT_THAT(std::string(status.message()),
              AllOf(HasSubstr("180 cages of 1000000 vertices"), HasSubstr("--frames glb")));
}

TEST_F(DeformFramesTest, SaysWhereFramesGoAndWhichOneIsWrong) {
  const Ended no_folder = Deform("b.dss");
  EXPECT_EQ(no_folder.code, 2);
  EXPECT_THAT(no_folder.err, HasSubstr("3 cages need a folder"));
  EXPECT_EQ(Deform("b.glb", {"--frames", "obj"}).code, 2);
  EXPECT_EQ(Deform("out/", {"--fps", "30"}).code, 2);
  for (const char* option : {"--fps", "--crease-sharpness"}) {
    const Ended made = Deform("clip.glb", {option, "nan"});
    EXPECT_EQ(made.code, 2);
    EXPECT_THAT(made.err, HasSubstr("nan is not a number"));
  }
  std::ofstream(Frame(1)) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  const Ended other = Deform("b.glb");
  EXPECT_EQ(other.code, 3);
  EXPECT_THAT(other.err, HasSubstr("f1.obj: the cage has 3 vertices"));
  EXPECT_FALSE(fs::exists(At("b.glb")));
}

}  // namespace
}  // namespace rilievo
