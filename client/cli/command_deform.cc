#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands.h"
#include "client/cli/deform_frames.h"
#include "client/cli/edited_cage.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_folder.h"
#include "client/cli/output_target.h"
#include "client/cli/surface_output.h"
#include "client/formats/file_kind.h"
#include "core/base/status_macros.h"
#include "core/codec/container/encode_deformed.h"
#include "core/loop/refinement.h"
#include "core/pipeline/edit_level.h"
#include "server/command_line/real_range.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

struct DeformArguments {
  std::string input;
  std::vector<std::string> cages;
  SurfaceOutputArguments output;
  std::optional<double> crease_sharpness, frames_per_second;
  std::optional<std::string> frames;  // what is written into a folder
  std::optional<int> level;           // whose vertices the cage has; none: the control mesh
  bool json = false;
};

constexpr double kFramesPerSecond = 24;

void Print(const DeformArguments& arguments, size_t bytes, const EditedCage& cage) {
  const size_t creases = cage.mesh.creases.size();
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
      << LabelledLine("creases",
                      absl::StrCat(Grouped(static_cast<int64_t>(creases)),
                                   arguments.crease_sharpness ? " of that sharpness"
                                   : cage.tagged              ? ", as the cage says"
                                                 : ", as before: the cage says nothing"));
}

void Print(const DeformArguments& arguments, const WrittenFrames& written) {
  if (arguments.json) {
    const nlohmann::ordered_json report = {
        {"output", arguments.output.output}, {"frames", written.frames}, {"bytes", written.bytes}};
    std::cout << report.dump(2) << '\n';
    return;
  }
  std::cout << arguments.output.output << '\n'
            << LabelledLine("frames", Grouped(written.frames))
            << LabelledLine("size", Counted(written.bytes, "byte", "bytes"));
}

// With the path of what is at fault.
absl::Status AtFault(const std::string& surface, const std::string& cage,
                     const absl::Status& status) {
  return AtPath(absl::IsFailedPrecondition(status) ? surface : cage, status);
}

absl::Status DeformOnce(const DeformArguments& arguments, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceTarget target, SurfaceTargetOf(arguments.output));
  const std::string& path = arguments.cages.front();
  CommandFiles files{.inputs = {arguments.input, path}, .outputs = PathsOf({target})};
  if (arguments.json) files.text.push_back("-");
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> before, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface own, DecodeBytes(arguments.input, before, context));
  RILIEVO_ASSIGN_OR_RETURN(const EditedCage cage,
                           ReadEditedCage(path, arguments.input, own.surface.control_mesh,
                                          arguments.crease_sharpness, context));
  const absl::StatusOr<std::vector<uint8_t>> after = ReplaceControlMesh(before, cage.mesh);
  if (!after.ok()) return AtFault(arguments.input, path, after.status());
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, *after, context));
  Print(arguments, after->size(), cage);
  return absl::OkStatus();
}

void Print(const DeformArguments& arguments, size_t bytes, const TargetsMissed& missed,
           double diagonal) {
  const double rms = missed.rms * diagonal, max = missed.max * diagonal;
  if (arguments.json) {
    const nlohmann::ordered_json report = {{"output", arguments.output.output},
                                           {"bytes", bytes},
                                           {"missed_rms", rms},
                                           {"missed_max", max}};
    std::cout << report.dump(2) << '\n';
    return;
  }
  WordsBeside(arguments.output.output)
      << arguments.output.output << '\n'
      << LabelledLine("size", absl::StrCat(Counted(static_cast<int64_t>(bytes), "byte", "bytes"),
                                           " as a .dss file"))
      << LabelledLine("missed",
                      absl::StrFormat("RMS %.3g, max %.3g between vertices and where they "
                                      "were put",
                                      rms, max));
}

// The vertices of a level have been moved.
absl::Status DeformLevel(const DeformArguments& arguments, const RunContext& context) {
  const std::string& path = arguments.cages.front();
  if (arguments.crease_sharpness) {
    return UsageError("--crease-sharpness is about the control mesh; leave out --level, or it");
  }
  if (Extension(path) == "dss") {
    return UsageError(absl::StrCat("--cage ", path,
                                   ": --level takes a mesh, and a .dss holds a "
                                   "control mesh; leave out --level, or export the mesh"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceTarget target, SurfaceTargetOf(arguments.output));
  CommandFiles files{.inputs = {arguments.input, path}, .outputs = PathsOf({target})};
  if (arguments.json) files.text.push_back("-");
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> before, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface own, DecodeBytes(arguments.input, before, context));
  if (*arguments.level > own.surface.max_level) {
    return UsageError(absl::StrCat("--level ", *arguments.level, ": ", arguments.input,
                                   " has levels 0 to ", own.surface.max_level));
  }
  RILIEVO_ASSIGN_OR_RETURN(const EditedCage mesh,
                           ReadEditedCage(path, arguments.input, {}, std::nullopt, context));
  const absl::StatusOr<EditedLevel> edited =
      EditLevel(before, *arguments.level, {mesh.mesh.vertices, mesh.mesh.faces, {}}, context);
  if (!edited.ok()) return AtFault(arguments.input, path, edited.status());
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, edited->dss, context));
  Print(arguments, edited->dss.size(), edited->missed, own.surface.frame.diagonal);
  return absl::OkStatus();
}

// Several cages, or one into a folder.
absl::Status DeformFrames(const DeformArguments& arguments, const RunContext& context) {
  const std::string& output = arguments.output.output;
  const bool clip = !NamesAFolder(output);
  if (clip && Extension(output) != "glb") {
    return UsageError(absl::StrCat("--output ", output, ": ", arguments.cages.size(),
                                   " cages need a folder, ", output, "/, or one .glb of all"));
  }
  if (arguments.output.keep_dss) {
    return UsageError("--keep-dss is for one cage; use --frames dss with a folder");
  }
  const FramesRequest request = {arguments.input, arguments.cages, arguments.crease_sharpness,
                                 output, arguments.frames_per_second.value_or(kFramesPerSecond)};
  const std::string kind = arguments.frames.value_or("pose");
  CommandFiles files{.inputs = {arguments.input}, .outputs = {output}};
  files.inputs.insert(files.inputs.end(), arguments.cages.begin(), arguments.cages.end());
  if (!clip) {
    RILIEVO_ASSIGN_OR_RETURN(files.outputs, FrameFiles(request, kind));
  }
  if (arguments.json) files.text.push_back("-");
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> dss, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface own, DecodeBytes(arguments.input, dss, context));
  RILIEVO_ASSIGN_OR_RETURN(
      const WrittenFrames written,
      clip ? WriteClip(request, own, context) : WriteFrames(request, kind, dss, own, context));
  Print(arguments, written);
  return absl::OkStatus();
}

absl::Status Deform(const DeformArguments& arguments, std::stop_token stop) {
  RunContext context;
  context.stop = stop;
  const std::string& output = arguments.output.output;
  const bool folder = NamesAFolder(output), one = arguments.cages.size() == 1 && !folder;
  if (arguments.frames && !folder) {
    return UsageError(absl::StrCat("--frames ", *arguments.frames,
                                   " is about the files of a folder; write --output ", output,
                                   "/, or leave it out"));
  }
  if (arguments.frames_per_second && (folder || one)) {
    return UsageError("--fps is for several cages in one .glb; leave it out");
  }
  if (!arguments.level) {
    return one ? DeformOnce(arguments, context) : DeformFrames(arguments, context);
  }
  if (!one) return UsageError("--level takes one --cage and no folder");
  return DeformLevel(arguments, context);
}

}  // namespace

Command AddDeform(CLI::App& program) {
  CLI::App* app =
      program.add_subcommand("deform", "Move a surface by an edited cage, its detail with it");
  const auto arguments = std::make_shared<DeformArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file; - is standard input")
      ->required();
  app->add_option(
         "--cage", arguments->cages,
         "the control mesh as 'rilievo export IN cage.obj --cage' writes it, with vertices "
         "moved or creases changed; where it has no line 't crease' or 't corner', "
         "the creases of the surface stay; or a .dss with such a control mesh; several: frames")
      ->required();
  AddSurfaceOutput(app,
                   "of several cages a folder, see --frames, or a .glb with an animation through "
                   "all of them; ",
                   &arguments->output)
      ->required();
  app->add_option("--frames", arguments->frames,
                  "what is written for each cage into a folder: a pose (default), the control mesh "
                  "alone, which takes its heights from IN when it is a --cage itself; dss; or a "
                  "mesh: ply, obj, stl, glb, 3mf, usda")
      ->check(CLI::IsMember({"pose", "dss", "ply", "obj", "stl", "glb", "3mf", "usda"}));
  app->add_option("--fps", arguments->frames_per_second, "frames per second of a .glb; default 24")
      ->check(RealRange(CLI::Range(0.01, 1000.0)));
  app->add_option("--level", arguments->level,
                  "the --cage is the mesh of this level of the surface, as 'rilievo export IN "
                  "mesh.obj --level L' writes it: its vertices are moved, the detail of finer "
                  "levels rides along")
      ->check(CLI::Range(0, kMaxLoopLevel));
  app->add_option("--crease-sharpness", arguments->crease_sharpness,
                  "sharpness of all creases: 0 (none, no corners) to 10 (sharp at every level); "
                  "default as they "
                  "are")
      ->check(RealRange(CLI::Range(0.0, 10.0)));
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Deform(*arguments, stop); }};
}

}  // namespace rilievo
