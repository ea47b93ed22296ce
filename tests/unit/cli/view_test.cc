// Pictures as the program draws them.
#include "client/cli/web_viewer.h"
#include "client/picture/image.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;

class ViewTest : public ProgramFixture {
 protected:
  Image Picture(const std::string& name) {
    const auto image = DecodePng(Content(At(name)));
    EXPECT_TRUE(image.ok()) << image.status();
    return image.ok() ? *image : Image{};
  }

  // A program of the test's own, which StartWithOurs finds before any other.
  void WriteProgram(const std::string& name, const std::string& script) const {
    std::ofstream(At(name)) << "#!/bin/sh\n" << script;
    fs::permissions(At(name), fs::perms::owner_all);
  }

  void WritePage() const {
    fs::create_directory(At("page"));
    std::ofstream(At("page/index.html")) << "page";
    std::ofstream(At("gateway.mjs")) << "gateway";
  }

  pid_t StartWithOurs(const std::vector<std::string>& arguments) const {
    const std::string path = getenv("PATH");
    setenv("RILIEVO_WEB", folder_.c_str(), 1);
    setenv("PATH", (folder_.string() + ":" + path).c_str(), 1);
    const pid_t child = Start(arguments);
    setenv("PATH", path.c_str(), 1);
    unsetenv("RILIEVO_WEB");
    return child;
  }
};

int PixelsOf(const Image& image, const std::function<bool(int, int, int)>& kind) {
  int count = 0;
  for (size_t i = 0; i + 2 < image.rgb.size(); i += 3) {
    count += kind(image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]);
  }
  return count;
}

bool Background(int r, int g, int b) { return r == 255 && g == 255 && b == 255; }

TEST_F(ViewTest, OwnColoursAreDrawn) {
  std::ofstream(At("a.obj")) << "v -1 -1 0 0 1 0\nv 1 -1 0 0 1 0\nv 1 1 0 0 1 0\nf 1 2 3\n";
  const auto draw = [&](const std::string& input, const std::string& colors) {
    return Run({"view", At(input), "-o", At("a.png"), "--size", "64x64", "--elevation", "89",
                "--colors", colors});
  };
  const auto green = [](int r, int g, int b) { return g > 100 && r < g / 2 && b < g / 2; };
  ASSERT_EQ(draw("a.obj", "own").code, 0);
  EXPECT_GT(PixelsOf(Picture("a.png"), green), 100);
  ASSERT_EQ(draw("a.obj", "shade").code, 0);
  EXPECT_EQ(PixelsOf(Picture("a.png"), green), 0);
  std::ofstream(At("points.csv")) << "x,y,z,red,green,blue\n0,0,0,0,200,0\n1,0,0,0,200,0\n"
                                     "1,1,0,0,200,0\n0,1,0,0,200,0\n";
  ASSERT_EQ(draw("points.csv", "own").code, 0);
  EXPECT_GT(PixelsOf(Picture("a.png"), green), 3);
  std::ofstream(At("plain.obj")) << "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nf 1 2 3\n";
  const Ended refused = draw("plain.obj", "own");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, HasSubstr("has no colours"));
}

TEST_F(ViewTest, EdgesAreDrawnWhereTheyAreSeen) {
  // Two triangles over each other: the lower one's edges are hidden but for its rim.
  std::ofstream(At("a.obj")) << "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n";
  const auto dark = [](int r, int g, int b) { return r < 150 && g < 150 && b < 160; };
  const auto draw = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {
        "view",        At("a.obj"), "-o",     At("a.png"), "--size",        "200x200",
        "--elevation", "89",        "--turn", "0",         "--orthographic"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return PixelsOf(Picture("a.png"), dark);
  };
  EXPECT_EQ(draw({}), 0);
  // Four sides of about 180 pixels and the diagonal, a pixel wide.
  const int edges = draw({"--edges"});
  EXPECT_GT(edges, 800);
  EXPECT_LT(edges, 2500);
}

TEST_F(ViewTest, ATurntableIsOneAnimationOrNumberedPictures) {
  ASSERT_EQ(Run({"simulate", "torus", "-o", At("a.ply"), "--points", "2000"}).code, 0);
  const Ended one =
      Run({"view", At("a.ply"), "-o", At("a.png"), "--size", "80x60", "--turntable", "5"});
  ASSERT_EQ(one.code, 0) << one.err;
  EXPECT_THAT(one.out, HasSubstr("5 frames"));
  const std::string animation = Content(At("a.png"));
  size_t frames = 0;
  for (size_t at = 0; (at = animation.find("fcTL", at)) != std::string::npos; at += 4) ++frames;
  EXPECT_EQ(frames, 5u);
  // Those who do not know of animations see the first picture.
  const Image first = Picture("a.png");

  const Ended many = Run({"view", At("a.ply"), "-o", At("turn-%02d.png"), "--size", "80x60",
                          "--turntable", "5", "--json"});
  ASSERT_EQ(many.code, 0) << many.err;
  EXPECT_EQ(Json::parse(many.out)["outputs"].size(), 5u);
  EXPECT_EQ(Picture("turn-00.png").rgb, first.rgb);
  EXPECT_NE(Picture("turn-02.png").rgb, first.rgb);
  // The scene keeps its size: a body of revolution fills the same pixels at every turn.
  const auto drawn = [](const Image& image) {
    return PixelsOf(image, [](int r, int g, int b) { return !Background(r, g, b); });
  };
  EXPECT_NEAR(drawn(Picture("turn-03.png")), drawn(first), 0.05 * drawn(first));
  EXPECT_EQ(Run({"view", At("a.ply"), "-o", At("in/"), "--size", "80", "--turntable", "2"}).code,
            0);
  EXPECT_TRUE(fs::exists(At("in/frame-001.png")));
  EXPECT_EQ(Run({"view", At("a.ply"), "-o", At("%s.png"), "--turntable", "3"}).code, 2);
  EXPECT_EQ(Run({"view", At("a.ply"), "-o", At("a.png"), "--turntable", "3", "--views", "2"}).code,
            2);
}

TEST_F(ViewTest, PartsAndColorsOfASurface) {
  ASSERT_EQ(Run({"simulate", "star", "-o", At("scan.ply"), "--points", "6000"}).code, 0);
  ASSERT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
  const auto draw = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"view", At("a.dss"), "-o", At("a.png"), "--size", "120"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_LE(WidestLine(ended.out.substr(ended.out.find("png"))), 80u) << ended.out;
    return ended.out;
  };
  EXPECT_THAT(draw({"--show", "domain"}), HasSubstr("smooth surface"));
  const Image domain = Picture("a.png");
  EXPECT_THAT(draw({"--show", "control-mesh", "--edges"}), HasSubstr("control mesh"));
  EXPECT_THAT(draw({}), HasSubstr("surface at level"));
  EXPECT_NE(Picture("a.png").rgb, domain.rgb);
  EXPECT_THAT(draw({"--colors", "error", "--scan", At("scan.ply")}), HasSubstr("full red"));
  EXPECT_THAT(draw({"--colors", "displacement"}), HasSubstr("of the diagonal"));
  EXPECT_EQ(Run({"view", At("a.dss"), "-o", At("a.png"), "--colors", "error"}).code, 2);
  EXPECT_EQ(Run({"view", At("scan.ply"), "-o", At("a.png"), "--show", "domain"}).code, 2);
  const Ended piped = RunPiped(Content(At("a.dss")), {"view", "-", "-o", "-", "--size", "120"});
  EXPECT_EQ(piped.code, 0) << piped.err;
  EXPECT_TRUE(DecodePng(piped.out).ok());
}

TEST_F(ViewTest, TheViewerSaysWhatItLacks) {
  std::ofstream(At("a.dss")) << "any";
  EXPECT_EQ(Run({"view", "--open", "-o", At("a.png")}).code, 2);
  EXPECT_EQ(Run({"view", "-", "--open"}).code, 2);
  EXPECT_EQ(Run({"view", At("a.dss"), "--listen", "127.0.0.1:0"}).code, 2);
  EXPECT_THAT(Run({"view", At("a.dss")}).err, HasSubstr("-o is missing"));
  EXPECT_THAT(Run({"view", At("none.dss"), "--open"}).err, HasSubstr("none.dss: no such file"));
  setenv("RILIEVO_WEB", folder_.c_str(), 1);
  Ended ended = Run({"view", At("a.dss"), "--open"});
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("./dev web builds it"));
  // The page is there, Node is not.
  WritePage();
  const std::string path = getenv("PATH");
  setenv("PATH", folder_.c_str(), 1);
  ended = Run({"view", At("a.dss"), "--open"});
  setenv("PATH", path.c_str(), 1);
  unsetenv("RILIEVO_WEB");
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("Node 18.19 or newer"));
}

// `node` of this test: prints what the gateway does, and tells what it was given.
TEST_F(ViewTest, TheViewerStartsTheGatewayAndEndsIt) {
  std::ofstream(At("a.dss")) << "any";
  WritePage();
  WriteProgram("node", "printf '%s\\n' \"$@\" >" + At("given") +
                           "\necho rilievo on http://127.0.0.1:9/\n"
                           "cat >/dev/null; echo ended >" +
                           At("ended") + "\n");
  const pid_t child = StartWithOurs({"view", At("a.dss"), "--open", "--json"});
  for (int i = 0; i < 200 && Content(At("stdout")).find('}') == std::string::npos; ++i) {
    usleep(50'000);
  }
  kill(child, SIGKILL);  // even so the gateway hears of it
  EXPECT_EQ(Wait(child).code, -SIGKILL);
  EXPECT_EQ(Json::parse(Content(At("stdout")))["url"], "http://127.0.0.1:9/");
  EXPECT_THAT(Content(At("given")), HasSubstr("--file\n" + At("a.dss")));
  EXPECT_THAT(Content(At("given")), HasSubstr("--server\n127.0.0.1:"));
  for (int i = 0; i < 200 && !fs::exists(At("ended")); ++i) usleep(50'000);
  EXPECT_TRUE(fs::exists(At("ended")));
}

TEST_F(ViewTest, AGatewayThatEndsByItselfIsAnError) {
  WritePage();
  WriteProgram("node", "echo rilievo on http://127.0.0.1:9/\n");
  const Ended ended = Wait(StartWithOurs({"view", "--open", "--json"}));
  EXPECT_EQ(Json::parse(ended.out)["url"], "http://127.0.0.1:9/");
  EXPECT_EQ(ended.code, 4);
  EXPECT_THAT(ended.err, HasSubstr("no longer served"));
}

// Its server has no limits: only this machine reaches it.
TEST_F(ViewTest, TheViewerListensOnThisMachineAlone) {
  WritePage();
  WriteProgram("node", "echo rilievo on http://127.0.0.1:9/\n");
  for (const std::string listen : {"0.0.0.0:8080", ":8080", "[::]:8080", "192.0.2.7:0"}) {
    const Ended ended = Wait(StartWithOurs({"view", "--open", "--json", "--listen", listen}));
    EXPECT_EQ(ended.code, 2) << listen;
    EXPECT_THAT(ended.err, HasSubstr("--listen " + listen));
    EXPECT_THAT(ended.err, HasSubstr("ssh -L"));
    EXPECT_EQ(ended.out, "");
  }
  for (const std::string listen : {"127.0.0.1:0", "localhost:8080", "[::1]:0"}) {
    const Ended ended = Wait(StartWithOurs({"view", "--open", "--json", "--listen", listen}));
    EXPECT_THAT(ended.out, HasSubstr("http://127.0.0.1:9/")) << listen << ended.err;
  }
}

TEST_F(ViewTest, TheBrowserIsOpenedEachTime) {
  constexpr int kRounds = 20;
  const std::string path = getenv("PATH");
  const char* display = getenv("DISPLAY");
  const std::string display_before = display == nullptr ? "" : display;
  WriteProgram("xdg-open", "echo \"$1\" >>" + At("opened") + "\n");
  setenv("DISPLAY", ":0", 1);
  setenv("PATH", (folder_.string() + ":" + path).c_str(), 1);
  std::string all;
  for (int i = 0; i < kRounds; ++i) {
    EXPECT_TRUE(OpenInBrowser("http://127.0.0.1:9/"));
    all += "http://127.0.0.1:9/\n";
  }
  fs::create_directory(At("empty"));
  fs::create_symlink("/bin/sh", At("empty/sh"));
  setenv("PATH", At("empty").c_str(), 1);
  EXPECT_FALSE(OpenInBrowser("http://127.0.0.1:9/"));  // no xdg-open
  setenv("PATH", path.c_str(), 1);
  setenv("DISPLAY", display_before.c_str(), 1);
  for (int i = 0; i < 200 && Content(At("opened")).size() < all.size(); ++i) usleep(50'000);
  EXPECT_EQ(Content(At("opened")), all);
}

}  // namespace
}  // namespace rilievo
