#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/surface_output.h"
#include "client/formats/mesh_reader.h"
#include "core/base/status_macros.h"
#include "core/codec/container/encode_deformed.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

struct DeformArguments {
  std::string input, cage;
  SurfaceOutputArguments output;
  std::optional<double> crease_sharpness;
  bool json = false;
};

// The tags of the surface stand where the file has none: editors that do not know them drop them.
ControlMesh CageOf(MeshFile file, const ControlMesh& own) {
  ControlMesh cage{std::move(file.mesh.vertices), std::move(file.mesh.triangles)};
  cage.creases = file.tags ? std::move(file.tags->creases) : own.creases;
  cage.corners = file.tags ? std::move(file.tags->corners) : own.corners;
  return cage;
}

void SetSharpness(double sharpness, ControlMesh* cage) {
  if (sharpness == 0) {
    cage->creases.clear();
    cage->corners.clear();
  }
  for (Crease& crease : cage->creases) crease.sharpness = static_cast<float>(sharpness);
}

void Print(const DeformArguments& arguments, size_t bytes, size_t creases, bool tagged) {
  if (arguments.json) {
    const nlohmann::ordered_json report = {
        {"output", arguments.output.output}, {"bytes", bytes}, {"creases", creases}};
    std::cout << report.dump(2) << '\n';
    return;
  }
  std::ostream& out = WordsBeside(arguments.output.output);
  out << arguments.output.output << '\n'
      << LabelledLine("size", absl::StrCat(Counted(static_cast<int64_t>(bytes), "byte", "bytes"),
                                           " as a .dss file"))
      << LabelledLine("creases", absl::StrCat(Grouped(static_cast<int64_t>(creases)),
                                              arguments.crease_sharpness ? " of that sharpness"
                                              : tagged                   ? ", as the cage says"
                                                       : ", as before: the cage says nothing"));
}

absl::Status Deform(const DeformArguments& arguments, std::stop_token stop) {
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceTarget target, SurfaceTargetOf(arguments.output));
  CommandFiles files{.inputs = {arguments.input, arguments.cage}, .outputs = PathsOf({target})};
  if (arguments.json) files.text.push_back("-");
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> before, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(MeshFile file, ReadMesh(arguments.cage));
  if (file.place != ScanPlace{}) {
    return WithExitCode(
        absl::InvalidArgumentError(absl::StrCat(
            arguments.cage, ": a ", file.format,
            " has its own unit and way up; give the cage as OBJ or PLY, in the coordinates of ",
            arguments.input)),
        ExitCode::kUsage);
  }
  const bool tagged = file.tags.has_value();
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface own, DecodeBytes(arguments.input, before, context));
  ControlMesh cage = CageOf(std::move(file), own.surface.control_mesh);
  if (arguments.crease_sharpness) SetSharpness(*arguments.crease_sharpness, &cage);
  const absl::StatusOr<std::vector<uint8_t>> after = ReplaceControlMesh(before, cage);
  if (!after.ok()) {
    const bool of_surface = absl::IsFailedPrecondition(after.status());
    return absl::Status(after.status().code(),
                        absl::StrCat(of_surface ? arguments.input : arguments.cage, ": ",
                                     after.status().message()));
  }
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, *after, context));
  Print(arguments, after->size(), cage.creases.size(), tagged);
  return absl::OkStatus();
}

}  // namespace

Command AddDeform(CLI::App& program) {
  CLI::App* app =
      program.add_subcommand("deform", "Move a surface by an edited cage, its detail with it");
  const auto arguments = std::make_shared<DeformArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file; - is standard input")
      ->required();
  app->add_option(
         "--cage", arguments->cage,
         "the control mesh as 'rilievo export IN cage.obj --cage' writes it, with vertices "
         "moved or creases changed; where it has no line 't crease' or 't corner', "
         "the creases of the surface stay")
      ->required();
  AddSurfaceOutput(app, "", &arguments->output)->required();
  app->add_option("--crease-sharpness", arguments->crease_sharpness,
                  "sharpness of all creases: 0 (none, no corners) to 10 (sharp at every level); "
                  "default as they "
                  "are")
      ->check(CLI::Range(0.0, 10.0));
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Deform(*arguments, stop); }};
}

}  // namespace rilievo
