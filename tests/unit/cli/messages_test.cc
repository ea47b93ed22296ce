// What people read when a command line is wrong, to the letter.
#include "client/cli/server_words.h"
#include "server/command_line/usage_message.h"
#include "tests/unit/cli/program_fixture.h"

namespace rilievo {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

struct Case {
  std::string words;  // with blanks between
  int code;
  std::string error;
};

const Case kCases[] = {
    {"", 2,
     R"(rilievo: a command is missing; the commands are reconstruct, convert, diagnose,
  align, export, info, measure, evaluate, voxelize, combine, verify, compare,
  simulate, view, jobs, completion
See 'rilievo --help'.
)"},
    {"scan.ply", 2,
     R"(rilievo: 'scan.ply' is a file, not a command; did you mean:
  rilievo reconstruct scan.ply -o scan.dss
See 'rilievo --help'.
)"},
    {"a.dss", 2,
     R"(rilievo: 'a.dss' is a file, not a command; did you mean:
  rilievo info a.dss
  rilievo view a.dss -o a.png
See 'rilievo --help'.
)"},
    {"reconstuct scan.ply -o b.dss", 2,
     R"(rilievo: 'reconstuct' is not a command; did you mean 'reconstruct'?
See 'rilievo --help'.
)"},
    {"polish", 2,
     R"(rilievo: 'polish' is not a command; the commands are reconstruct, convert,
  diagnose, align, export, info, measure, evaluate, voxelize, combine, verify,
  compare, simulate, view, jobs, completion
See 'rilievo --help'.
)"},
    {"jobs", 2,
     R"(rilievo jobs: a command is missing; the commands are submit, convert, list,
  show, watch, fetch, cancel, delete, delete-scan
See 'rilievo jobs --help'.
)"},
    {"jobs sumbit scan.ply", 2,
     R"(rilievo jobs: 'sumbit' is not a command; did you mean 'submit'?
See 'rilievo jobs --help'.
)"},
    {"jobs list", 2,
     R"(rilievo jobs list: --server is missing: HOST:PORT of a rilievod that keeps jobs
See 'rilievo jobs list --help'.
)"},
    {"jobs fetch x --server 127.0.0.1:1 -o b.dss --tls-key k", 2,
     R"(rilievo jobs fetch: --tls-key needs --tls-cert too
See 'rilievo jobs fetch --help'.
)"},
    {"reconstruct", 2,
     R"(rilievo reconstruct: SCAN is missing: the points: PLY, PCD, XYZ, PTS, TXT, OBJ,
  LAS, LAZ, E57, PTX
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply", 2,
     R"(rilievo reconstruct: --output is missing: the surface, a .dss file
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o", 2,
     R"(rilievo reconstruct: --output: its value is missing
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.dss --max-lvel 3", 2,
     R"(rilievo reconstruct: --max-lvel is not an option; did you mean --max-level?
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.dss --max-level two", 2,
     R"(rilievo reconstruct: --max-level: 'two' is not a number from 0 to 8
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.dss --max-error 1", 2,
     R"(rilievo reconstruct: --max-error: '1' is a fraction of the diagonal, and must be
  from 1e-06 to 0.1; a length has its unit (5mm)
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.dss --topology flat", 2,
     R"(rilievo reconstruct: --topology: 'flat' is not one of auto, planar, spherical,
  arbitrary
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.dss --seed x", 2,
     R"(rilievo reconstruct: --seed: 'x' is not a number, or not a whole one where that
  is needed
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.foo", 2,
     R"(rilievo reconstruct: --output b.foo: .foo is not known; write .dss for the
  surface, or .ply, .obj, .stl, .glb, .3mf or .usda for a mesh of it
)"},
    {"reconstruct scan.ply -o scan.ply", 2,
     R"(rilievo reconstruct: scan.ply: this output would overwrite the input; name
  another file
)"},
    {"reconstruct scan.ply few.xyz -o b.dss", 2,
     R"(rilievo reconstruct: --output b.dss: 2 inputs need a folder; write b.dss/
)"},
    {"reconstruct few.xyz -o b.dss --quiet", 3,
     R"(rilievo reconstruct: few.xyz: 5 points; a surface needs at least 20
)"},
    {"reconstruct identical.xyz -o b.dss --quiet", 3,
     R"(rilievo reconstruct: identical.xyz: all 500 finite points are identical; a
  surface needs distinct ones
)"},
    {"reconstruct mesh.obj -o b.dss", 3,
     R"(rilievo reconstruct: mesh.obj: a mesh of 1 face, not a scan; 'rilievo convert'
  makes a surface of it; or add --points-only to take its 3 vertices as the
  points of a scan and leave its faces out
)"},
    {"export a.dss b.blend", 2,
     R"(rilievo export: b.blend: the extension must be .ply, .obj, .stl, .glb, .3mf,
  .usda or .png; a folder (DIR/) gets 3D Tiles
)"},
    {"export a.dss b.ply --level 1 --triangles 5", 2,
     R"(rilievo export: --level and --triangles exclude each other; give one of them
See 'rilievo export --help'.
)"},
    {"export a.dss b.ply --triangles 3", 3,
     R"(rilievo export: --triangles 3: the surface has at least 128, those of its
  control mesh; ask for as many or more
)"},
    {"export a.dss b.ply --camera 1 2", 2,
     R"(rilievo export: --camera: 3 values are needed, not 2
See 'rilievo export --help'.
)"},
    {"export a.dss b.ply c.ply", 2,
     R"(rilievo export: 'c.ply' is one word too many
See 'rilievo export --help'.
)"},
    {"view", 2,
     R"(rilievo view: IN is missing: what to draw
)"},
    {"view scan.ply -o b.png --size axb", 2,
     R"(rilievo view: --size axb: write 960 or 960x720
)"},
    {"simulate cow -o b.ply", 2,
     R"(rilievo simulate: SHAPE: 'cow' is not one of sphere, torus, genus2, terrain,
  cutbox, pair, star, bracket, thinwalls
See 'rilievo simulate --help'.
)"},
};

TEST_F(ProgramFixture, WrongCommandLinesSayWhatIsWrong) {
  fs::current_path(folder_);
  ASSERT_EQ(Run({"simulate", "sphere", "-o", "scan.ply", "--points", "2000"}).code, 0);
  ASSERT_EQ(Run({"reconstruct", "scan.ply", "-o", "a.dss", "--quiet"}).code, 0);
  std::ofstream(At("few.xyz")) << "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n";
  std::ofstream identical(At("identical.xyz"));
  for (int i = 0; i < 500; ++i) identical << "1 2 3\n";
  identical.close();
  std::ofstream(At("mesh.obj")) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const Case& wrong : kCases) {
    std::istringstream in(wrong.words);
    const std::vector<std::string> arguments(std::istream_iterator<std::string>(in), {});
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, wrong.code) << wrong.words;
    EXPECT_EQ(ended.err, wrong.error) << wrong.words;
    EXPECT_LE(WidestLine(ended.err), 80u) << wrong.words;
    EXPECT_THAT(ended.err, Not(HasSubstr("header."))) << wrong.words;
    EXPECT_FALSE(fs::exists("b.dss") || fs::exists("b.ply")) << wrong.words;
  }
  fs::current_path("/");
}

TEST(ServerWordsTest, FieldsAreOptions) {
  EXPECT_EQ(OptionOfField("header.options.encode.max_error_ratio"), "--max-error");
  EXPECT_EQ(OptionOfField("header.options.place.metres_per_unit"), "--unit");
  EXPECT_EQ(OptionOfField("options.max_level"), "--max-level");
  EXPECT_EQ(OptionOfField("header.options.control.close_holes_below_length"),
            "--close-holes-below");
  EXPECT_EQ(OptionOfField("header.options.control.control_mesh.faces"), "--control-mesh");
  EXPECT_EQ(OptionOfField("request_id"), "--request-id");
  EXPECT_EQ(OptionOfField("header.point_count"), "");
  EXPECT_EQ(OptionOfField("points"), "");
  EXPECT_EQ(OptionOfField("header.options.fit.rounds"), "rounds");
  EXPECT_EQ(WordsOf(absl::UnavailableError("no route")), "no route");
}

TEST(UsageMessageTest, TheNearestWordIsNotFar) {
  const std::vector<std::string> known = {"reconstruct", "export", "info"};
  EXPECT_EQ(Nearest("recontruct", known), "reconstruct");
  EXPECT_EQ(Nearest("exprot", known), "export");
  EXPECT_EQ(Nearest("inof", known), "");  // half of its letters
  EXPECT_EQ(Nearest("ifo", known), "info");
  EXPECT_EQ(Nearest("x", known), "");
}

}  // namespace
}  // namespace rilievo
