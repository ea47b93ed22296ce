// A mesh as the output of `reconstruct`, and meshes that are taken for scans.
#include "client/formats/mesh_reader.h"
#include "client/formats/mesh_writer.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using MeshOutputTest = ProgramFixture;

TEST_F(MeshOutputTest, IsWhatExportMakes) {
  ASSERT_EQ(Run({"simulate", "torus", "-o", At("scan.ply"), "--points", "3000"}).code, 0);
  ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
  for (const std::string extension : {"ply", "obj", "stl", "glb", "3mf", "usda"}) {
    const std::string mesh = At("m." + extension), expected = At("e." + extension);
    const Ended made = Run({"reconstruct", At("scan.ply"), "-o", mesh});
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_THAT(made.out, HasSubstr("as a .dss file"));
    ASSERT_EQ(Run({"export", At("a.dss"), expected}).code, 0);
    EXPECT_EQ(Content(mesh), Content(expected)) << extension;
    EXPECT_FALSE(fs::exists(At("m.dss")));
  }
  ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("M.PLY"), "--keep-dss", "--report",
                 At("r.json"), "--quiet"})
                .code,
            0);
  EXPECT_EQ(Content(At("M.PLY")), Content(At("e.ply")));
  EXPECT_EQ(Content(At("M.dss")), Content(At("a.dss")));
  EXPECT_EQ(Json::parse(Content(At("r.json")))["kept_dss"], At("M.dss"));
}

TEST_F(MeshOutputTest, AnUnknownExtensionIsRefusedWithTheKnownOnes) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "500"}).code, 0);
  for (const std::string name : {"m.foo", "m.png", "m.dss.gz"}) {
    const Ended ended = Run({"reconstruct", At("scan.ply"), "-o", At(name)});
    EXPECT_EQ(ended.code, 2) << name;
    EXPECT_THAT(ended.err, HasSubstr("usda"));
    EXPECT_FALSE(fs::exists(At(name)));
  }
  EXPECT_EQ(Run({"view", At("scan.ply"), "-o", At("a.jpg")}).code, 2);
  EXPECT_EQ(Run({"simulate", "sphere", "-o", At("a.pcd")}).code, 2);
  EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--keep-dss"}).code, 2);
  EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("out/"), "--keep-dss"}).code, 2);
  for (const std::string name : {"plain", "out.stream"}) {
    ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At(name), "--quiet"}).code, 0);
    EXPECT_THAT(Content(At(name)).substr(0, 5), HasSubstr("DSS"));
  }
}

class MeshInputTest : public ProgramFixture {
 protected:
  MeshInputTest() {
    EXPECT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "2000"}).code, 0);
    EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
    for (const char* extension : {"ply", "obj", "stl"}) {
      const std::string mesh = At(std::string("mesh.") + extension);
      EXPECT_EQ(Run({"export", At("a.dss"), mesh, "--level", "1"}).code, 0);
    }
  }
};

TEST_F(MeshInputTest, IsRefusedWithTheOptionThatTakesItsPoints) {
  for (const std::string name : {"mesh.ply", "mesh.obj", "mesh.stl"}) {
    const Ended refused = Run({"reconstruct", At(name), "-o", At("b.dss")});
    EXPECT_EQ(refused.code, 3) << name;
    EXPECT_THAT(refused.err, HasSubstr("--points-only"));
    EXPECT_FALSE(fs::exists(At("b.dss")));
    // The same as the vertices written as points.
    const auto mesh = ReadMesh(At(name));
    ASSERT_TRUE(mesh.ok()) << mesh.status();
    std::ofstream points(At("points.ply"), std::ios::binary);
    ASSERT_TRUE(WritePlyPoints(mesh->mesh.vertices, Eigen::Matrix3Xd(3, 0), points).ok());
    points.close();
    ASSERT_EQ(Run({"reconstruct", At("points.ply"), "-o", At("c.dss"), "--quiet"}).code, 0);
    const Ended taken =
        Run({"reconstruct", At(name), "-o", At("b.dss"), "--points-only", "--quiet"});
    ASSERT_EQ(taken.code, 0) << taken.err;
    EXPECT_EQ(Content(At("b.dss")), Content(At("c.dss"))) << name;
    fs::remove(At("b.dss"));
  }
}

TEST_F(MeshInputTest, EveryCommandThatReadsAScanSaysSo) {
  const std::string mesh = At("mesh.ply");
  for (std::vector<std::string> command : std::vector<std::vector<std::string>>{
           {"diagnose", mesh},
           {"verify", At("a.dss"), mesh},
           {"view", At("a.dss"), "-o", At("a.png"), "--colors", "error", "--scan", mesh},
           {"export", At("a.dss"), At("b.ply"), "--carry", mesh}}) {
    const Ended refused = Run(command);
    EXPECT_EQ(refused.code, 3) << command[0];
    EXPECT_THAT(refused.err, HasSubstr("a mesh of 512 faces")) << command[0];
    command.push_back("--points-only");
    EXPECT_THAT(Run(command).err, ::testing::Not(HasSubstr("a mesh of 512 faces"))) << command[0];
  }
  const Ended submitted = Run({"jobs", "submit", mesh, "--server", "127.0.0.1:1"});
  EXPECT_EQ(submitted.code, 3) << submitted.err;
  // A mesh that holds no faces is a scan.
  std::ofstream(At("none.ply")) << "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n"
                                   "property float y\nproperty float z\nelement face 0\n"
                                   "property list uchar int vertex_indices\nend_header\n1 2 3\n";
  EXPECT_THAT(Run({"diagnose", At("none.ply")}).err, HasSubstr("at least 20"));
}

}  // namespace
}  // namespace rilievo
