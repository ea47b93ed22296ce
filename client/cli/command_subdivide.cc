#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/given_cage.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/formats/atomic_file.h"
#include "client/formats/file_kind.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/surface_writer.h"
#include "core/base/status_macros.h"
#include "core/schemes/subdivide_mesh.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

struct SubdivideArguments {
  std::string input, output, scheme = "loop";
  int levels = 1;
  bool json = false;
};

// OBJ keeps polygons and tags; the other formats get them as fans of triangles.
absl::Status WritePolygons(const std::string& path, const PolygonMesh& mesh,
                           const SubdivisionTags& tags, const ScanPlace& place) {
  if (Extension(path) != "obj") return WriteMesh(path, FansOf(mesh), {}, {}, place);
  return WriteFileAtomically(path, [&](std::ostream& out) -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(WriteObjPolygons(mesh, out));
    WriteObjTags(tags.creases, tags.corners, out);
    return absl::OkStatus();
  });
}

void Print(const SubdivideArguments& arguments, const PolygonMesh& mesh) {
  if (arguments.json) {
    std::cout << nlohmann::ordered_json({{"output", arguments.output},
                                         {"scheme", arguments.scheme},
                                         {"levels", arguments.levels},
                                         {"vertices", mesh.vertices.cols()},
                                         {"faces", mesh.face_count()}})
                     .dump(2)
              << '\n';
    return;
  }
  WordsBeside(arguments.output) << arguments.output << ": " << arguments.scheme << ", "
                                << Counted(arguments.levels, "level", "levels") << "; "
                                << Counted(mesh.vertices.cols(), "vertex", "vertices") << ", "
                                << Counted(mesh.face_count(), "face", "faces") << '\n';
}

absl::Status Subdivide(const SubdivideArguments& arguments, std::stop_token stop) {
  CommandFiles files{.inputs = {arguments.input}, .outputs = {arguments.output}};
  if (arguments.json) files.text.push_back("-");
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RILIEVO_RETURN_IF_ERROR(WithExitCode(
      CheckMeshExtension(arguments.output, Extension(arguments.output)), ExitCode::kUsage));
  RILIEVO_ASSIGN_OR_RETURN(const SubdivisionScheme scheme, SchemeNamed(arguments.scheme));
  RILIEVO_ASSIGN_OR_RETURN(GivenCage cage, ReadGivenCage(arguments.input));
  RunContext context;
  context.stop = stop;
  SubdivisionTags tags;
  const absl::StatusOr<PolygonMesh> made =
      SubdivideMesh(cage.mesh, scheme, arguments.levels, cage.tags, context, &tags);
  if (!made.ok()) {
    const absl::Status named(made.status().code(),
                             absl::StrCat(arguments.input, ": ", made.status().message()));
    return absl::IsResourceExhausted(named) ? WithExitCode(named, ExitCode::kUsage) : named;
  }
  RILIEVO_RETURN_IF_ERROR(
      WithExitCode(WritePolygons(arguments.output, *made, tags, cage.place), ExitCode::kOutput));
  Print(arguments, *made);
  return absl::OkStatus();
}

}  // namespace

Command AddSubdivide(CLI::App& program) {
  CLI::App* app = program.add_subcommand("subdivide", "Refine a mesh by a subdivision scheme");
  const auto arguments = std::make_shared<SubdivideArguments>();
  app->add_option("MESH", arguments->input,
                  "the mesh, open or closed: PLY, OBJ, STL, GLB; polygons of a PLY or OBJ stay "
                  "polygons; - is standard input")
      ->required();
  app->add_option("-o,--output", arguments->output,
                  "the refined mesh: .obj keeps polygons, .ply, .stl, .glb and .3mf have triangles")
      ->required();
  app->add_option("--scheme", arguments->scheme,
                  "loop, butterfly and sqrt3 take triangles, catmull-clark and doo-sabin any "
                  "polygons; loop knows the creases and corners of an OBJ; default loop")
      ->check(CLI::IsMember({"loop", "catmull-clark", "doo-sabin", "butterfly", "sqrt3"}));
  app->add_option("--levels", arguments->levels, "steps of refinement; default 1")
      ->check(CLI::Range(0, kMostSubdivisionLevels));
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Subdivide(*arguments, stop); }};
}

}  // namespace rilievo
