#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/text_layout.h"
#include "client/formats/file_kind.h"
#include "client/formats/mesh_writer.h"
#include "core/base/status_macros.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {
namespace {

struct ExportArguments {
  std::string input, output;
  std::optional<int> level;
};

absl::Status Export(const ExportArguments& arguments, std::stop_token stop) {
  const std::string extension = Extension(arguments.output);
  if (extension != "ply" && extension != "obj" && extension != "stl") {
    return WithExitCode(absl::InvalidArgumentError(absl::StrCat(
                            arguments.output, ": the extension must be .ply, .obj or .stl")),
                        ExitCode::kUsage);
  }
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, LoadDss(arguments.input, context));
  const int level = arguments.level.value_or(decoded.surface.max_level);
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh mesh, Tessellate(decoded.surface, level, context));
  const std::vector<HeightSource> sources = SourcesAtLevel(decoded.surface, level);
  RILIEVO_RETURN_IF_ERROR(
      WithExitCode(WriteMesh(arguments.output, mesh, sources), ExitCode::kOutput));
  std::cout << Wrap(absl::StrCat(arguments.output, ": level ", level, ", ",
                                 Counted(mesh.vertices.cols(), "vertex", "vertices"), ", ",
                                 Counted(mesh.triangles.cols(), "face", "faces")),
                    2)
            << '\n';
  return absl::OkStatus();
}

}  // namespace

Command AddExport(CLI::App& program) {
  CLI::App* app = program.add_subcommand("export", "Write a surface as a triangle mesh");
  const auto arguments = std::make_shared<ExportArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file")->required();
  app->add_option("OUT", arguments->output,
                  "the mesh: .ply (with normals and, a vertex, where its height comes from: 0 "
                  "measured, 1 smoothed, 2 filled in), .obj or .stl")
      ->required();
  app->add_option("--level", arguments->level,
                  "fineness: 0 is the control mesh's; default the finest")
      ->check(CLI::Range(0, 10));
  return {app, [arguments](std::stop_token stop) { return Export(*arguments, stop); }};
}

}  // namespace rilievo
