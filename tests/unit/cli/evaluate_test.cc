// Positions and closest points by the command line.
#include <cmath>

#include "core/codec/container/dss.h"
#include "core/evaluate/displaced_evaluator.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class EvaluateTest : public ProgramFixture {
 protected:
  EvaluateTest() {
    EXPECT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "3000"}).code, 0);
    EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
    const std::string bytes = Content(At("a.dss"));
    surface_ =
        DecodeDss({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()}, RunContext())
            ->surface;
  }
  DisplacedSurface surface_;
};

void ExpectVector(const Json& json, const Eigen::Vector3d& vector) {
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(json[static_cast<size_t>(axis)].get<double>(), vector[axis]);
  }
}

TEST_F(EvaluateTest, SaysWhatTheEvaluatorSays) {
  const DisplacedEvaluator evaluator = *DisplacedEvaluator::Build(surface_, RunContext());
  const Ended ended = Run({"evaluate", At("a.dss"), "--at", "5,0.25,0.5", "0,1,0", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const Json places = Json::parse(ended.out)["at"];
  ASSERT_EQ(places.size(), 2u);
  const SurfaceJet jet = evaluator.At(5, 0.25, 0.5, JetOrder::kSecond);
  const SurfaceShape shape = ShapeOf(jet);
  EXPECT_EQ(places[0]["face"], 5);
  ExpectVector(places[0]["position"], jet.position);
  ExpectVector(places[0]["normal"], shape.normal);
  ExpectVector(places[0]["du"], jet.u);
  ExpectVector(places[0]["dvv"], jet.vv);
  EXPECT_EQ(places[0]["least_curvature"].get<double>(), shape.least_curvature);
  const SurfaceJet smooth = evaluator.LimitAt(5, 0.25, 0.5, JetOrder::kSecond);
  const Ended of_smooth =
      Run({"evaluate", At("a.dss"), "--at", "5,0.25,0.5", "--smooth", "--json"});
  ExpectVector(Json::parse(of_smooth.out)["at"][0]["position"], smooth.position);
  EXPECT_NE(smooth.position, jet.position);

  const Ended text = Run({"evaluate", At("a.dss"), "--at", "5,0.25,0.5"});
  EXPECT_EQ(text.code, 0);
  EXPECT_LE(WidestLine(text.out), 80u);
  for (const char* label :
       {"5,0.25,0.5\n", "  position ", "  normal ", "  duv ", "  curvatures "}) {
    EXPECT_THAT(text.out, HasSubstr(label));
  }
}

TEST_F(EvaluateTest, TellsIrregularVertices) {
  // The control mesh of a sphere has vertices of another valence than 6.
  std::vector<int> valence(static_cast<size_t>(surface_.control_mesh.vertices.cols()), 0);
  for (const int corner : surface_.control_mesh.faces.reshaped()) ++valence[corner];
  int face = 0;
  while (valence[surface_.control_mesh.faces(0, face)] == 6) ++face;
  const std::string word = std::to_string(face) + ",0,0";
  const Json place =
      Json::parse(Run({"evaluate", At("a.dss"), "--at", word, "--json"}).out)["at"][0];
  EXPECT_TRUE(place["irregular_vertex"].get<bool>());
  EXPECT_TRUE(place["greatest_curvature"].is_null());
  EXPECT_THAT(Run({"evaluate", At("a.dss"), "--at", word}).out, HasSubstr("irregular vertex"));
}

TEST_F(EvaluateTest, FindsClosestPointsOfAScan) {
  std::ofstream(At("places.xyz")) << "2 0 0\n0 0 -3\n0.2 0.1 0.1\n";
  const Ended ended = Run({"evaluate", At("a.dss"), "--points", At("places.xyz"), "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const Json closest = Json::parse(ended.out)["closest"];
  ASSERT_EQ(closest.size(), 3u);
  const DisplacedEvaluator evaluator = *DisplacedEvaluator::Build(surface_, RunContext());
  const Eigen::Vector3d places[] = {{2, 0, 0}, {0, 0, -3}, {0.2, 0.1, 0.1}};
  for (size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d position =
        evaluator
            .At(closest[i]["face"].get<int>(), closest[i]["u"].get<double>(),
                closest[i]["v"].get<double>(), JetOrder::kPosition)
            .position;
    ExpectVector(closest[i]["position"], position);
    const double distance = closest[i]["distance"].get<double>();
    EXPECT_NEAR(distance, (places[i] - position).norm(), 1e-12);
    // The scan is of a unit sphere.
    EXPECT_NEAR(distance, std::abs(places[i].norm() - 1), 0.01);
  }
  // The text reads as a scan of the closest points.
  const Ended text = Run({"evaluate", At("a.dss"), "--points", At("places.xyz")});
  ASSERT_EQ(text.code, 0);
  EXPECT_EQ(text.out.substr(0, text.out.find('\n')), "# x y z distance face u v");
  std::istringstream lines(text.out.substr(text.out.find('\n')));
  double x = 0, y = 0, z = 0, distance = 0;
  ASSERT_TRUE(lines >> x >> y >> z >> distance);
  EXPECT_EQ(x, closest[0]["position"][0].get<double>());
  EXPECT_EQ(distance, closest[0]["distance"].get<double>());
}

TEST_F(EvaluateTest, RefusesWhatIsNoParameter) {
  const auto refused = [&](const std::vector<std::string>& arguments, int code,
                           const std::string& said) {
    std::vector<std::string> words = {"evaluate", At("a.dss")};
    words.insert(words.end(), arguments.begin(), arguments.end());
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, code) << ended.err;
    std::string error = ended.err;  // without its line breaks
    for (size_t at; (at = error.find("\n  ")) != std::string::npos;) error.replace(at, 3, " ");
    EXPECT_THAT(error, HasSubstr(said));
    EXPECT_EQ(ended.out, "");
  };
  refused({}, 2, "give --at or --points");
  refused({"--at", "1,2"}, 2, "--at 1,2: must be a control face");
  refused({"--at", "1,x,0"}, 2, "--at 1,x,0: must be");
  refused({"--at", "100000,0,0"}, 3, "--at 100000,0,0: face is 100000, this surface has");
  refused({"--at", "0,0.6,0.6"}, 3, "u is 0.6 and v is 0.6");
  refused({"--at", "0,0,0", "--points", At("scan.ply")}, 2, "exclude");
  refused({"--points", At("none.xyz")}, 3, "none.xyz");
  std::ofstream(At("bad.xyz")) << "0 0 1\nnan 0 1\n";
  refused({"--points", At("bad.xyz")}, 3, "point 1 has a coordinate that is not finite");
}

}  // namespace
}  // namespace rilievo
