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
#include "client/cli/output_target.h"
#include "client/cli/place_options.h"
#include "client/cli/surface_output.h"
#include "client/formats/atomic_file.h"
#include "client/formats/surface_writer.h"
#include "core/base/status_macros.h"
#include "core/codec/container/encode_smooth.h"
#include "core/loop/interpolate_vertices.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

// Of a surface without heights: as fine as its pictures and meshes need by default.
constexpr int kSmoothLevels = 2;

struct InterpolateArguments {
  std::string input, cage;  // `cage`: file for the control mesh; empty: none
  SurfaceOutputArguments output;
  PlaceArguments place;
  bool json = false;
};

void Print(const InterpolateArguments& arguments, const InterpolatedMesh& made, int64_t vertices) {
  if (arguments.json) {
    std::cout << nlohmann::ordered_json({{"output", arguments.output.output},
                                         {"vertices", vertices},
                                         {"control_vertices", made.mesh.vertices.cols()},
                                         {"control_faces", made.mesh.faces.cols()},
                                         {"steps", made.steps}})
                     .dump(2)
              << '\n';
    return;
  }
  WordsBeside(arguments.output.output)
      << arguments.output.output << ": through " << Counted(vertices, "vertex", "vertices") << "; "
      << Counted(made.mesh.faces.cols(), "control face", "control faces") << ", "
      << Counted(made.steps, "step", "steps") << '\n';
}

absl::Status Interpolate(const InterpolateArguments& arguments, std::stop_token stop) {
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceTarget target, SurfaceTargetOf(arguments.output));
  CommandFiles files{.inputs = {arguments.input}, .outputs = PathsOf({target})};
  if (!arguments.cage.empty()) {
    RILIEVO_RETURN_IF_ERROR(CheckExtension(arguments.cage, "obj", "the cage is an OBJ file"));
    files.outputs.push_back(arguments.cage);
  }
  if (arguments.json) files.text.push_back("-");
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(GivenCage given, ReadGivenCage(arguments.input));
  TriangleMesh fans = FansOf(given.mesh);
  const ControlMesh mesh{std::move(fans.vertices), std::move(fans.triangles),
                         std::move(given.tags.creases), std::move(given.tags.corners)};
  const auto made = InterpolateVertices(mesh, {}, context);
  if (!made.ok()) return AtPath(arguments.input, made.status());
  DssMetadata metadata;
  metadata.generator = "rilievo " RILIEVO_VERSION;
  metadata.topology = "user";
  metadata.place = PlaceOf(arguments.place, std::move(given.place));
  const auto encoded = EncodeSmoothSurface(made->mesh, kSmoothLevels, metadata, context);
  if (!encoded.ok()) return AtPath(arguments.input, encoded.status());
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, encoded->Concatenate(), context));
  if (!arguments.cage.empty()) {
    RILIEVO_RETURN_IF_ERROR(WithExitCode(WriteFileAtomically(arguments.cage,
                                                             [&](std::ostream& out) {
                                                               return WriteObjCage(
                                                                   made->mesh, SpatialFrame(), out);
                                                             }),
                                         ExitCode::kOutput));
  }
  Print(arguments, *made, mesh.vertices.cols());
  return absl::OkStatus();
}

}  // namespace

Command AddInterpolate(CLI::App& program) {
  CLI::App* app =
      program.add_subcommand("interpolate", "Make a smooth surface through all vertices of a mesh");
  const auto arguments = std::make_shared<InterpolateArguments>();
  app->add_option("MESH", arguments->input,
                  "the mesh, open or closed: PLY, OBJ with its creases and corners, STL, GLB; "
                  "polygons are cut into triangles; - is standard input")
      ->required();
  AddSurfaceOutput(app, "", &arguments->output)->required();
  app->add_option("--keep-cage", arguments->cage,
                  "write the control mesh to this .obj file; its surface passes through the "
                  "vertices to 1e-10, that of a .dss to 1e-8 of the diagonal");
  AddPlaceOptions(app, &arguments->place);
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Interpolate(*arguments, stop); }};
}

}  // namespace rilievo
