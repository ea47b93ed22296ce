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
     R"(rilievo: a command is missing; the commands are reconstruct, convert, update,
  diagnose, align, export, info, measure, evaluate, voxelize, combine, trim,
  deform, subdivide, scale, interpolate, verify, compare, simulate, view, jobs,
  completion
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
  update, diagnose, align, export, info, measure, evaluate, voxelize, combine,
  trim, deform, subdivide, scale, interpolate, verify, compare, simulate, view,
  jobs, completion
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
  .step, .usda or .png; a folder (DIR/) gets 3D Tiles
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
    {"-v", 2,
     R"(rilievo: -v is not an option; did you mean --version?
See 'rilievo --help'.
)"},
    {"help recontruct", 2,
     R"(rilievo: 'recontruct' is not a command; did you mean 'reconstruct'?
See 'rilievo --help'.
)"},
    {"reconstruct scna.ply", 2,
     R"(rilievo reconstruct: --output is missing: the surface, a .dss file
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply --max-error 0.1%", 2,
     R"(rilievo reconstruct: --output is missing: the surface, a .dss file
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply b.dss", 2,
     R"(rilievo reconstruct: --output is missing: the surface, a .dss file; did you mean
  -o b.dss?
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct --in scan.ply --out b.ply", 2,
     R"(rilievo reconstruct: --in is not an option
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.dss --depth 10", 2,
     R"(rilievo reconstruct: --depth is not an option
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct missing.ply -o b.dss", 3,
     R"(rilievo reconstruct: missing.ply: cannot be read: No such file or directory
)"},
    {"reconstruct a.dss -o b.ply", 3,
     R"(rilievo reconstruct: a.dss: a .dss file holds a surface, not a scan; 'rilievo
  export' makes a mesh of it, 'rilievo info' and 'rilievo view' show it
)"},
    {"reconstruct notes.txt -o b.dss", 3,
     R"(rilievo reconstruct: notes.txt: points, line 1: neither numbers nor a heading
  that names the columns x, y and z (or easting, northing and height)
)"},
    {"reconstruct empty.ply -o b.dss", 3,
     R"(rilievo reconstruct: empty.ply: the file is empty
)"},
    {"reconstruct scan.ply -o b.dss --max-error 1cm", 2,
     R"(rilievo reconstruct: --max-error 1cm: the unit of scan.ply is not known; say
  with --unit what one unit of its coordinates is (--unit m), or write a
  fraction of the diagonal (0.1%) or a length in its own units (0.02u)
)"},
    {"reconstruct scan.ply -o b.dss --max-error 1parsec", 2,
     R"(rilievo reconstruct: --max-error: '1parsec' is not a length: write a fraction of
  the diagonal (0.001 or 0.1%), a number with a unit (2cm; units are km, m, dm,
  cm, mm, um, in, ft, us-ft) or one in the scan's own units (0.02u)
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.dss --max-error 0.1% --max-bytes 1000", 2,
     R"(rilievo reconstruct: --max-error and --max-bytes exclude each other; give one of
  them
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.dss --unit metre", 2,
     R"(rilievo reconstruct: --unit: 'metre' is not one of km, m, dm, cm, mm, um, in,
  ft, us-ft
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o b.dss --up w", 2,
     R"(rilievo reconstruct: --up: 'w' is not one of x, y, z, -x, -y, -z
See 'rilievo reconstruct --help'.
)"},
    {"reconstruct scan.ply -o nofolder/b.dss --quiet", 6,
     R"(rilievo reconstruct: nofolder/b.dss: cannot be written: No such file or
  directory
)"},
    {"convert scan.ply -o b.dss", 3,
     R"(rilievo convert: scan.ply: 2,000 points without a face, not a mesh; 'rilievo
  reconstruct' makes a surface of them
)"},
    {"convert a.dss -o b.ply", 3,
     R"(rilievo convert: a.dss: a .dss file holds a surface already, not a mesh;
  'rilievo export' makes a mesh of it
)"},
    {"export a.dss", 2,
     R"(rilievo export: OUT is missing: the mesh: .ply (with normals and, per vertex,
  where its height comes from: 0 measured, 1 smoothed, 2 filled in), .obj, .stl,
  .glb or .3mf
See 'rilievo export --help'.
)"},
    {"export scan.ply b.obj", 3,
     R"(rilievo export: scan.ply: not a surface (.dss); 'rilievo reconstruct' makes one
  of a scan, 'rilievo convert' of a mesh
)"},
    {"export a.dss b.obj --level fine", 2,
     R"(rilievo export: --level: 'fine' is not a number from 0 to 10
See 'rilievo export --help'.
)"},
    {"info scan.ply", 3,
     R"(rilievo info: scan.ply: not a surface (.dss); 'rilievo reconstruct' makes one of
  a scan, 'rilievo convert' of a mesh
)"},
    {"info missing.dss", 3,
     R"(rilievo info: missing.dss: cannot be read: No such file or directory
)"},
    {"verify scan.ply a.dss", 3,
     R"(rilievo verify: scan.ply: not a surface (.dss); 'rilievo reconstruct' makes one
  of a scan, 'rilievo convert' of a mesh
)"},
    {"compare a.dss", 2,
     R"(rilievo compare: B is missing: the shape to compare it with
See 'rilievo compare --help'.
)"},
    {"combine mesh.obj mesh.obj -o b.dss", 2,
     R"(rilievo combine: what to make is missing; give --union, --intersection or
  --difference
)"},
    {"combine mesh.obj --union -o b.dss", 2,
     R"(rilievo combine: SOLID: 2 values are needed, not 1
See 'rilievo combine --help'.
)"},
    {"view a.dss", 2,
     R"(rilievo view: -o is missing: the picture, a PNG; or --open, for the viewer in a
  browser
)"},
    {"view a.dss -o b.jpg", 2,
     R"(rilievo view: --output b.jpg: the picture is a PNG; give the name the extension
  .png
)"},
    {"view a.dss -o b.png --colors error", 2,
     R"(rilievo view: --colors error: name the scan that the error is to: --scan SCAN
)"},
    {"voxelize a.dss b.vox --resolution 64", 2,
     R"(rilievo voxelize: b.vox: the extension must be .nrrd, .vdb or .raw
)"},
    {"voxelize a.dss b.vdb", 2,
     R"(rilievo voxelize: the size of the voxels is missing; give --resolution or
  --voxel
)"},
    {"measure scan.ply", 3,
     R"(rilievo measure: scan.ply: there are no triangles, so no area and no volume
)"},
    {"evaluate a.dss", 2,
     R"(rilievo evaluate: where to evaluate is missing; give --at or --points
)"},
    {"evaluate a.dss --at 0,2,2", 3,
     R"(rilievo evaluate: --at 0,2,2: u is 2 and v is 2; both must be at least 0 and
  their sum at most 1
)"},
    {"align scan.ply", 2,
     R"(rilievo align: scan.ply: one scan alone; give at least two
)"},
    {"jobs submit scan.ply", 2,
     R"(rilievo jobs submit: --server is missing: HOST:PORT of a rilievod that keeps
  jobs
See 'rilievo jobs submit --help'.
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
  std::ofstream(At("notes.txt")) << "junk\n";
  std::ofstream(At("empty.ply")).flush();
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

TEST_F(ProgramFixture, HelpOfACommandIsWhatItsOptionPrints) {
  EXPECT_EQ(Run({"help", "export"}).out, Run({"export", "--help"}).out);
  EXPECT_EQ(Run({"help"}).out, Run({"--help"}).out);
}

TEST_F(ProgramFixture, TooFewBytesAreTheCommandsFault) {
  ASSERT_EQ(Run({"simulate", "sphere", "-o", At("scan.ply"), "--points", "2000"}).code, 0);
  const Ended ended = Run({"reconstruct", At("scan.ply"), "-o", At("b.dss"), "--max-bytes", "10"});
  EXPECT_EQ(ended.code, 3);
  EXPECT_THAT(ended.err, HasSubstr("max_bytes is 10"));
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
