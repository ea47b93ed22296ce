// No output replaces what it is made from, nor another output, whatever its name.
#include <functional>

#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;

constexpr char kOctahedron[] =
    "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\nf 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\n"
    "f 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n";

class OverwritingTest : public ProgramFixture {
 protected:
  OverwritingTest() {
    EXPECT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "500"}).code, 0);
    EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", At("a.dss"), "--quiet"}).code, 0);
    std::ofstream(At("mesh.obj")) << kOctahedron;
    std::ofstream(At("token.txt")) << "secret\n";
  }

  // All names of a file: its own, through "./", a symbolic and a hard link, those with `extension`.
  std::vector<std::string> NamesOf(const std::string& name, const std::string& extension) {
    const std::string soft = At("soft" + extension), hard = At("hard" + extension);
    fs::remove(soft);
    fs::remove(hard);
    fs::create_symlink(At(name), soft);
    fs::create_hard_link(At(name), hard);
    return {At(name), At("./" + name), soft, hard};
  }

  // The command with each name of `input` as its output ends with 2 and leaves the input as it is.
  void ExpectKept(
      const std::string& input, const std::string& extension,
      const std::function<std::vector<std::string>(const std::string& output)>& command) {
    const std::string before = Content(At(input));
    for (const std::string& output : NamesOf(input, extension)) {
      const Ended ended = Run(command(output));
      EXPECT_EQ(ended.code, 2) << output << "\n" << ended.err;
      EXPECT_LE(WidestLine(ended.err), 80u + output.size()) << ended.err;
      if (fs::path(output).extension() == extension) {
        EXPECT_THAT(ended.err, HasSubstr("overwrite")) << output;
      }
      EXPECT_EQ(Content(At(input)), before) << output;
    }
  }
};

TEST_F(OverwritingTest, Reconstruct) {
  const std::string scan = At("scan.ply"), out = At("out.dss");
  ExpectKept("scan.ply", ".ply", [&](const std::string& output) {
    return std::vector<std::string>{"reconstruct", scan, "-o", output};
  });
  ExpectKept("scan.ply", ".json", [&](const std::string& output) {
    return std::vector<std::string>{"reconstruct", scan, "-o", out, "--report", output};
  });
  ExpectKept("mesh.obj", ".obj", [&](const std::string& output) {
    return std::vector<std::string>{"reconstruct",  scan, "--control-mesh",
                                    At("mesh.obj"), "-o", output};
  });
  ExpectKept("token.txt", ".dss", [&](const std::string& output) {
    return std::vector<std::string>{"reconstruct", scan,           "--server",
                                    "127.0.0.1:1", "--token-file", At("token.txt"),
                                    "-o",          output};
  });
  EXPECT_FALSE(fs::exists(out));
}

TEST_F(OverwritingTest, TheDssKeptBesideAMesh) {
  fs::create_hard_link(At("scan.ply"), At("out.dss"));
  const std::string before = Content(At("scan.ply"));
  const Ended ended =
      Run({"reconstruct", At("scan.ply"), "-o", At("out.glb"), "--keep-dss", "--quiet"});
  EXPECT_EQ(ended.code, 2) << ended.err;
  EXPECT_EQ(Content(At("scan.ply")), before);
}

TEST_F(OverwritingTest, AFolderOfSurfaces) {
  fs::copy(At("scan.ply"), At("other.ply"));
  fs::create_directory(At("out"));
  fs::create_symlink(At("other.ply"), At("out/scan.dss"));
  const std::string before = Content(At("other.ply"));
  const Ended ended = Run({"reconstruct", At("scan.ply"), At("other.ply"), "-o", At("out")});
  EXPECT_EQ(ended.code, 2) << ended.err;
  EXPECT_EQ(Content(At("other.ply")), before);
}

TEST_F(OverwritingTest, View) {
  ExpectKept("scan.ply", ".png", [&](const std::string& output) {
    return std::vector<std::string>{"view", At("scan.ply"), "-o", output};
  });
  ExpectKept("scan.ply", ".png", [&](const std::string& output) {
    return std::vector<std::string>{"view",   At("a.dss"),    "--colors", "error",
                                    "--scan", At("scan.ply"), "-o",       output};
  });
  fs::create_directory(At("turn"));
  fs::create_hard_link(At("scan.ply"), At("turn/frame-001.png"));
  const std::string before = Content(At("scan.ply"));
  EXPECT_EQ(Run({"view", At("scan.ply"), "-o", At("turn/"), "--turntable", "2"}).code, 2);
  EXPECT_EQ(Content(At("scan.ply")), before);
}

TEST_F(OverwritingTest, Export) {
  ExpectKept("a.dss", ".obj", [&](const std::string& output) {
    return std::vector<std::string>{"export", At("a.dss"), output};
  });
  ExpectKept("scan.ply", ".ply", [&](const std::string& output) {
    return std::vector<std::string>{"export", At("a.dss"), output, "--carry", At("scan.ply")};
  });
}

TEST_F(OverwritingTest, Jobs) {
  // Refused before a server is looked for: there is none.
  ExpectKept("scan.ply", ".ply", [&](const std::string& output) {
    return std::vector<std::string>{"jobs",        "submit", At("scan.ply"), "--server",
                                    "127.0.0.1:1", "-o",     output};
  });
  ExpectKept("token.txt", ".dss", [&](const std::string& output) {
    return std::vector<std::string>{"jobs",          "fetch",       "some-job",
                                    "--server",      "127.0.0.1:1", "--token-file",
                                    At("token.txt"), "-o",          output};
  });
}

TEST_F(OverwritingTest, StandardInputAndOutput) {
  const std::string before = Content(At("scan.ply"));
  stdin_ = At("scan.ply");
  EXPECT_EQ(Run({"reconstruct", "-", "-o", At("scan.ply")}).code, 2);
  stdin_.clear();
  const std::string command = RILIEVO_PROGRAM " compare " + At("scan.ply") + " " + At("a.dss") +
                              " --json >> " + At("scan.ply") + " 2> " + At("said");
  EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 2);
  EXPECT_THAT(Content(At("said")), HasSubstr("the standard output"));
  EXPECT_EQ(Content(At("scan.ply")), before);
  // A device holds nothing that could be lost.
  EXPECT_EQ(Run({"reconstruct", At("scan.ply"), "-o", "/dev/null", "--report", "/dev/null"}).code,
            0);
}

TEST_F(OverwritingTest, TwoOutputsAreTwoFiles) {
  for (const std::string name : {"out.dss", "./out.dss", "none/../out.dss"}) {
    const Ended ended =
        Run({"reconstruct", At("scan.ply"), "-o", At("out.dss"), "--report", At(name)});
    EXPECT_EQ(ended.code, 2) << name;
    EXPECT_THAT(ended.err, HasSubstr("two outputs"));
    EXPECT_FALSE(fs::exists(At("out.dss")));
  }
  EXPECT_EQ(
      Run({"reconstruct", At("scan.ply"), "-o", At("m.ply"), "--keep-dss", "--report", At("m.dss")})
          .code,
      2);
}

}  // namespace
}  // namespace rilievo
