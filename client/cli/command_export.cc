#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/text_layout.h"
#include "client/formats/file_kind.h"
#include "client/formats/mesh_writer.h"
#include "core/base/status_macros.h"
#include "core/surface/adaptive_tessellation.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {
namespace {

struct ExportArguments {
  std::string input, output;
  std::optional<int> level;
  AdaptiveOptions adaptive;
};

struct ExportedMesh {
  TriangleMesh mesh;
  std::vector<HeightSource> sources;
  std::string how;  // for people
};

absl::StatusOr<ExportedMesh> MeshOf(const DisplacedSurface& surface,
                                    const ExportArguments& arguments, const RunContext& context) {
  ExportedMesh exported;
  if (!arguments.adaptive.tolerance && !arguments.adaptive.triangles) {
    const int level = arguments.level.value_or(surface.max_level);
    RILIEVO_ASSIGN_OR_RETURN(exported.mesh, Tessellate(surface, level, context));
    exported.sources = SourcesAtLevel(surface, level);
    exported.how = absl::StrCat("level ", level);
    return exported;
  }
  RILIEVO_ASSIGN_OR_RETURN(AdaptiveMesh adaptive,
                           TessellateAdaptively(surface, arguments.adaptive, context));
  exported.mesh = std::move(adaptive.mesh);
  for (int v : adaptive.vertices) exported.sources.push_back(surface.sources[v]);
  exported.how = absl::StrCat("within ", Percent(adaptive.error), " of the diagonal of level ",
                              surface.max_level);
  return exported;
}

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
  RILIEVO_ASSIGN_OR_RETURN(const ExportedMesh exported,
                           MeshOf(decoded.surface, arguments, context));
  RILIEVO_RETURN_IF_ERROR(WithExitCode(WriteMesh(arguments.output, exported.mesh, exported.sources),
                                       ExitCode::kOutput));
  std::cout << Wrap(absl::StrCat(arguments.output, ": ", exported.how, ", ",
                                 Counted(exported.mesh.vertices.cols(), "vertex", "vertices"), ", ",
                                 Counted(exported.mesh.triangles.cols(), "face", "faces")),
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
  CLI::Option* level = app->get_option("--level");
  CLI::Option* tolerance =
      app->add_option("--tolerance", arguments->adaptive.tolerance,
                      "as few triangles as stay this near to the finest level, fraction of the "
                      "diagonal")
          ->check(CLI::Range(0.0, 1.0))
          ->excludes(level);
  app->add_option("--triangles", arguments->adaptive.triangles,
                  "at most so many triangles, where they are needed most")
      ->check(CLI::Range(int64_t{1}, int64_t{1} << 40))
      ->excludes(level)
      ->excludes(tolerance);
  return {app, [arguments](std::stop_token stop) { return Export(*arguments, stop); }};
}

}  // namespace rilievo
