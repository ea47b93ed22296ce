#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <utility>

#include "client/cli/commands.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/make_surfaces.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

struct ConvertArguments {
  MakingArguments making;
  std::string format;
};

}  // namespace

Command AddConvert(CLI::App& program) {
  CLI::App* app = program.add_subcommand("convert", "Make a surface from a triangle mesh");
  const auto a = std::make_shared<ConvertArguments>();
  app->add_option(
         "MESH", a->making.inputs,
         "the mesh, with its borders, handles and pieces: PLY, OBJ, STL, GLB; - is standard "
         "input; several become several surfaces")
      ->required();
  AddMakingOptions(app, ShapeInput::kMesh, &a->making);
  AddFormatOption(app, &a->format);
  return {app, [a](const std::stop_token& stop) {
            const auto read = [&](const std::string& path) -> absl::StatusOr<Source> {
              RILIEVO_ASSIGN_OR_RETURN(
                  ScanFile mesh, LoadMesh(path, a->format, a->making.options.colors != "ignore"));
              ReportPaths paths{path, mesh.format, {}};
              return Source{std::move(mesh), std::move(paths)};
            };
            return MakeSurfaces(a->making, a->making.inputs, read, {}, stop);
          }};
}

}  // namespace rilievo
