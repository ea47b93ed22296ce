// `rilievo trim`: what lies on one side of a shape becomes a surface.
#include <Eigen/Core>
#include <functional>
#include <map>
#include <sstream>

#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

class TrimTest : public ProgramFixture {
 protected:
  void SetUp() override {
    // A cube of side 2, and a polyline around the middle half of it.
    std::ofstream out(At("cube.obj"));
    for (int i = 0; i < 8; ++i) {
      out << "v " << 2 * (i & 1) << ' ' << (i & 2) << ' ' << 2 * (i >> 2) << '\n';
    }
    out << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    std::ofstream(At("square.xyz")) << "0.5 0.5 0\n1.5 0.5 0\n1.5 1.5 0\n0.5 1.5 0\n";
  }

  Ended Trim(std::vector<std::string> shape, const std::string& keep, const std::string& output,
             std::vector<std::string> more = {}) const {
    std::vector<std::string> words = {
        "trim",    At("cube.obj"), "--keep",          keep,  "-o",          At(output),
        "--quiet", "--json",       "--control-faces", "200", "--max-level", "2"};
    words.insert(words.end(), shape.begin(), shape.end());
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  }
};

// The vertices on the border of a mesh.
std::vector<Eigen::Vector3d> BorderOfObj(const std::string& path) {
  std::vector<Eigen::Vector3d> vertices;
  std::map<std::pair<int, int>, int> sides;  // faces at each edge
  std::ifstream in(path);
  for (std::string line, word; std::getline(in, line);) {
    std::istringstream words(line);
    words >> word;
    if (word == "v") {
      Eigen::Vector3d v;
      words >> v[0] >> v[1] >> v[2];
      vertices.push_back(v);
    } else if (word == "f") {
      std::array<int, 3> face{};
      for (int& corner : face) {
        words >> word;
        corner = std::stoi(word);
      }
      for (size_t k = 0; k < 3; ++k) ++sides[std::minmax(face[k], face[(k + 1) % 3])];
    }
  }
  std::vector<Eigen::Vector3d> border;
  for (const auto& [ends, faces] : sides) {
    if (faces > 1) continue;
    for (const int v : {ends.first, ends.second}) {
      border.push_back(vertices[static_cast<size_t>(v - 1)]);
    }
  }
  return border;
}

TEST_F(TrimTest, OneSideBecomesASurface) {
  using Point = Eigen::Vector3d;
  const struct {
    std::vector<std::string> shape;
    std::string side;
    double area;
    int loops;  // of borders
    std::function<double(const Point&)> distance;
  } cases[] = {
      {{"--plane", "z=0.5"}, "inside", 8, 1, [](const Point& p) { return p.z() - 0.5; }},
      {{"--sphere", "0,0,0,1"},
       "outside",
       24 - 3 * 0.785398,
       1,
       [](const Point& p) { return p.norm() - 1; }},
      {{"--polyline", At("square.xyz"), "--along", "0,0,1"}, "inside", 2, 2, [](const Point& p) {
         return (p - Point(1, 1, 0)).head<2>().cwiseAbs().maxCoeff() - 0.5;
       }}};
  for (const auto& [shape, side, area, loops, distance] : cases) {
    const Ended made = Trim(shape, side, "t.dss", {"--keep-mesh", At("t.ply")});
    ASSERT_EQ(made.code, 0) << made.err;
    EXPECT_EQ(Json::parse(made.out)["boundary_loops"], loops);
    const Json measured = Json::parse(Run({"measure", At("t.ply"), "--json"}).out);
    EXPECT_NEAR(measured["area"], area, 1e-4);
    EXPECT_EQ(Run({"compare", At("t.ply"), At("t.dss"), "--max-rms", "1e-3"}).code, 0);
    ASSERT_EQ(Run({"export", At("t.dss"), At("t.obj")}).code, 0);
    double farthest = 0;
    for (const Point& p : BorderOfObj(At("t.obj"))) {
      farthest = std::max(farthest, std::abs(distance(p)));
    }
    EXPECT_LT(farthest, 1e-5 * 2.4) << shape[0];  // the shortest diagonal
  }
}

TEST_F(TrimTest, CapsCloseTheSurface) {
  const Ended made = Trim({"--box", "1,1,1,3,3,3"}, "outside", "t.dss", {"--cap"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(Json::parse(made.out)["boundary_loops"], 0);
  EXPECT_NEAR(Json::parse(Run({"measure", At("t.dss"), "--json"}).out)["volume"], 7, 0.03);
}

TEST_F(TrimTest, SaysWhatIsWrong) {
  const std::pair<std::vector<std::string>, const char*> cases[] = {
      {{}, "the shape is missing"},
      {{"--plane", "z"}, "--plane z: must be"},
      {{"--box", "1,2,3"}, "two corners"},
      {{"--box", "0,0,0,1,1,0"}, "two corners that differ"},
      {{"--sphere", "0,0,0,0"}, "radius above"},
      {{"--polyline", At("square.xyz")}, "--along"},
      {{"--polyline", At("square.xyz"), "--along", "1"}, "DX,DY,DZ"},
      {{"--plane", "z=1", "--sphere", "0,0,0,1"}, "exclude each other"},
  };
  for (const auto& [shape, words] : cases) {
    const Ended made = Trim(shape, "inside", "t.dss");
    EXPECT_EQ(made.code, 2) << made.err;
    EXPECT_THAT(made.err, HasSubstr(words));
  }
  EXPECT_EQ(Trim({"--plane", "z=1"}, "below", "t.dss").code, 2);
  const Ended none = Trim({"--plane", "z=-1"}, "inside", "t.dss");
  EXPECT_EQ(none.code, 3);
  EXPECT_THAT(none.err, HasSubstr("nothing is left"));
  const std::vector<std::string> square = {"--polyline", At("square.xyz"), "--along", "0,0,1"};
  EXPECT_EQ(Trim(square, "inside", "square.xyz").code, 2);
  EXPECT_FALSE(fs::exists(At("t.dss")));
}

}  // namespace
}  // namespace rilievo
