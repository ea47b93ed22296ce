// Units, the way up and the place of a scan, from its file to what is exported.
#include <Eigen/Geometry>

#include "client/formats/mesh_reader.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/scan_reader.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class PlaceTest : public ProgramFixture {
 protected:
  PlaceTest() {
    EXPECT_EQ(Run({"simulate", "terrain", "-o", At("scan.ply"), "--points", "2000"}).code, 0);
  }

  // The .dss that reconstruct makes of scan.ply with these options.
  std::string Made(const std::vector<std::string>& options) const {
    std::vector<std::string> words = {"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"};
    words.insert(words.end(), options.begin(), options.end());
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return Content(At("a.dss"));
  }

  Json Info(const std::string& name) const {
    const Ended ended = Run({"info", At(name), "--json"});
    EXPECT_EQ(ended.code, 0) << ended.err;
    return Json::parse(ended.out);
  }

  // The scan moved to `place`, as a file of its own.
  void WriteMoved(const std::string& name, const Eigen::Vector3d& place) const {
    auto scan = ReadScan(At("scan.ply"));
    ASSERT_TRUE(scan.ok()) << scan.status();
    Eigen::Matrix3Xd points = scan->cloud.points.colwise() + place;
    std::ofstream out(At(name), std::ios::binary);
    ASSERT_TRUE(WritePlyPoints(points, Eigen::Matrix3Xd(3, 0), out).ok());
  }
};

TEST_F(PlaceTest, ALengthGivesTheBytesOfItsFraction) {
  Made({"--unit", "m"});
  const double diagonal = Info("a.dss")["frame"]["diagonal"];
  char fraction[40];
  std::snprintf(fraction, sizeof fraction, "%.17g", 0.02 / diagonal);
  const std::string by_fraction = Made({"--unit", "m", "--max-error", fraction});
  EXPECT_EQ(Made({"--unit", "m", "--max-error", "2cm"}), by_fraction);
  EXPECT_EQ(Made({"--unit", "m", "--max-error", "0.02u"}), by_fraction);
  EXPECT_EQ(Made({"--unit", "m", "--max-error", "20 mm"}), by_fraction);
  EXPECT_EQ(Made({"--max-error", "0.5%"}), Made({"--max-error", "0.005"}));
  EXPECT_EQ(Made({"--height-step", "0.01u"}).substr(0, 8), by_fraction.substr(0, 8));
  EXPECT_NE(Made({"--max-error", "0.02u"}), by_fraction);  // it does not name a unit
}

TEST_F(PlaceTest, ALengthNeedsTheUnitOfTheScan) {
  const Ended unknown =
      Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--max-error", "2cm", "--quiet"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err,
              AllOf(HasSubstr("--max-error 2cm"), HasSubstr("--unit"), HasSubstr("0.02u")));
  EXPECT_FALSE(fs::exists(At("a.dss")));
  const Ended large = Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--max-error", "9km",
                           "--unit", "m", "--quiet"});
  EXPECT_EQ(large.code, 3);
  EXPECT_THAT(large.err, AllOf(HasSubstr("max_error: 9000"), HasSubstr("must lie between")));
  EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--unit", "parsec"}).code, 2);
  EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--up", "w"}).code, 2);
}

TEST_F(PlaceTest, TheFileAndTheReportsSayIt) {
  const Ended made = Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--unit", "mm", "--up",
                          "-x", "--crs", "EPSG:25832", "--json"});
  ASSERT_EQ(made.code, 0) << made.err;
  const Json error = Json::parse(made.out)["error"]["scan_to_surface"];
  EXPECT_EQ(error["unit"], "mm");
  const Json info = Info("a.dss");
  EXPECT_EQ(info["place"]["metres_per_unit"], 0.001);
  EXPECT_EQ(info["place"]["unit"], "mm");
  EXPECT_EQ(info["place"]["up"], "-x");
  EXPECT_EQ(info["place"]["crs"], "EPSG:25832");
  EXPECT_THAT(Run({"info", At("a.dss")}).out,
              AllOf(HasSubstr("unit        mm, up -x"), HasSubstr("crs         EPSG:25832"),
                    HasSubstr("error       scan to surface: RMS")));
  // One error, however one asks.
  EXPECT_NEAR(double{info["scan_to_surface"]["rms"]} / double{error["rms"]}, 1, 1e-3);
  const Json verified = Json::parse(Run({"verify", At("a.dss"), At("scan.ply"), "--json"}).out);
  EXPECT_NEAR(double{verified["scan_to_surface"]["rms"]} / double{error["rms"]}, 1, 1e-3);
  const Json compared =
      Json::parse(Run({"compare", At("scan.ply"), At("a.dss"), "--json"}).out)["scan_to_surface"];
  EXPECT_EQ(compared["unit"], "mm");
  EXPECT_NEAR(double{compared["rms"]} / double{error["rms"]}, 1, 1e-3);
  EXPECT_THAT(Run({"compare", At("a.dss"), At("scan.ply")}).out,
              HasSubstr("error       scan to surface: RMS"));
  EXPECT_THAT(Run({"verify", At("a.dss"), At("scan.ply")}).out,
              HasSubstr("error       scan to surface: RMS"));
}

TEST_F(PlaceTest, AToleranceIsALengthToo) {
  Made({"--unit", "mm"});
  const double diagonal = Info("a.dss")["frame"]["diagonal"];
  char fraction[40];
  std::snprintf(fraction, sizeof fraction, "%.17g", 0.01 / diagonal);
  ASSERT_EQ(Run({"export", At("a.dss"), At("a.ply"), "--tolerance", fraction}).code, 0);
  ASSERT_EQ(Run({"export", At("a.dss"), At("b.ply"), "--tolerance", "10um"}).code, 0);
  ASSERT_EQ(Run({"export", At("a.dss"), At("c.ply"), "--tolerance", "0.01mm", "--unit", "mm"}).code,
            0);
  EXPECT_EQ(Content(At("a.ply")), Content(At("b.ply")));
  EXPECT_EQ(Content(At("a.ply")), Content(At("c.ply")));
  Made({});
  const Ended unknown = Run({"export", At("a.dss"), At("d.ply"), "--tolerance", "10um"});
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("--unit"));
  EXPECT_EQ(Run({"export", At("a.dss"), At("d.ply"), "--tolerance", "1mm", "--unit", "m",
                 "--camera", "0", "0", "9"})
                .code,
            2);
}

TEST_F(PlaceTest, ExportsStandAsTheFileSaysOrAsIsAsked) {
  Made({"--unit", "mm", "--up", "y"});
  const auto json_of = [&](const std::string& name) {
    const std::string glb = Content(At(name));
    return Json::parse(glb.substr(20, *reinterpret_cast<const uint32_t*>(glb.data() + 12)));
  };
  ASSERT_EQ(Run({"export", At("a.dss"), At("a.glb")}).code, 0);
  EXPECT_EQ(json_of("a.glb")["nodes"][0]["scale"], Json({0.001, 0.001, 0.001}));
  EXPECT_EQ(json_of("a.glb")["nodes"][0]["rotation"], Json({0, 0, 0, 1}));
  ASSERT_EQ(Run({"export", At("a.dss"), At("b.glb"), "--unit", "m", "--up", "z"}).code, 0);
  EXPECT_EQ(json_of("b.glb")["nodes"][0]["scale"], Json({1, 1, 1}));
  EXPECT_LT(json_of("b.glb")["nodes"][0]["rotation"][0], -0.7);
  ASSERT_EQ(Run({"export", At("a.dss"), At("a.usda")}).code, 0);
  EXPECT_THAT(Content(At("a.usda")),
              AllOf(HasSubstr("metersPerUnit = 0.001"), HasSubstr("upAxis = \"Y\"")));
  ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("c.glb"), "--quiet", "--unit", "mm",
                 "--up", "y"})
                .code,
            0);
  EXPECT_EQ(Content(At("c.glb")), Content(At("a.glb")));
  const Ended ply = Run({"export", At("a.dss"), At("a.ply"), "--up", "y"});
  EXPECT_EQ(ply.code, 2);
  EXPECT_THAT(ply.err, HasSubstr("has no way up"));
}

TEST_F(PlaceTest, MapCoordinatesKeepTheirDigitsInStl) {
  WriteMoved("map.ply", {635612, 5848912, 400});
  ASSERT_EQ(Run({"reconstruct", At("map.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
  const Ended warned = Run({"export", At("a.dss"), At("a.stl"), "--json"});
  ASSERT_EQ(warned.code, 0) << warned.err;
  EXPECT_THAT(Json::parse(warned.out)["warnings"][0],
              AllOf(HasSubstr("STL keeps seven digits"), HasSubstr("--origin auto")));
  const Ended direct = Run({"reconstruct", At("map.ply"), "-o", At("d.stl"), "--quiet"});
  EXPECT_THAT(direct.err, HasSubstr("STL keeps seven digits"));

  const Ended moved = Run({"export", At("a.dss"), At("b.stl"), "--origin", "auto", "--json"});
  const Json json = Json::parse(moved.out);
  EXPECT_EQ(json["warnings"], Json::array());
  const Eigen::Vector3d origin(json["origin"][0], json["origin"][1], json["origin"][2]);
  ASSERT_EQ(Run({"export", At("a.dss"), At("exact.ply")}).code, 0);
  const auto exact = ReadMesh(At("exact.ply")), stl = ReadMesh(At("b.stl"));
  ASSERT_TRUE(exact.ok() && stl.ok());
  const Eigen::Vector3d low = exact->mesh.vertices.rowwise().minCoeff();
  const double diagonal = (exact->mesh.vertices.rowwise().maxCoeff() - low).norm();
  EXPECT_LT((stl->mesh.vertices.rowwise().minCoeff() + origin - low).norm(), 1e-6 * diagonal);

  ASSERT_EQ(Run({"export", At("a.dss"), At("c.ply"), "--origin", "635612,5848912,400"}).code, 0);
  const auto shifted = ReadMesh(At("c.ply"));
  EXPECT_LT((shifted->mesh.vertices.colwise() + Eigen::Vector3d(635612, 5848912, 400) -
             exact->mesh.vertices)
                .cwiseAbs()
                .maxCoeff(),
            1e-6 * diagonal);
  ASSERT_EQ(Run({"export", At("a.dss"), At("c.usda"), "--origin", "635612,5848912,400"}).code, 0);
  EXPECT_THAT(Content(At("c.usda")), Not(HasSubstr("translate = (635")));
  for (const char* wrong : {"here", "1,2", "1,2,x", "1,2,inf"}) {
    EXPECT_EQ(Run({"export", At("a.dss"), At("c.ply"), "--origin", wrong}).code, 2) << wrong;
  }
}

}  // namespace
}  // namespace rilievo
