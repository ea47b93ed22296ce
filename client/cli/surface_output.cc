#include "client/cli/surface_output.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>

#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/cli/export_place.h"
#include "client/cli/output_folder.h"
#include "client/cli/output_target.h"
#include "client/formats/atomic_file.h"
#include "client/formats/file_kind.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/surface_writer.h"
#include "core/base/status_macros.h"
#include "core/codec/container/dss.h"
#include "core/surface/displaced_surface.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

namespace fs = std::filesystem;

bool IsMesh(const std::string& extension) {
  const std::vector<std::string> meshes = {"ply", "obj", "stl", "glb", "3mf", "usda"};
  return std::find(meshes.begin(), meshes.end(), extension) != meshes.end();
}

absl::Status WriteMeshOf(const DecodedSurface& decoded, const std::string& path,
                         const RunContext& context) {
  const DisplacedSurface& surface = decoded.surface;
  const ScanPlace& place = decoded.metadata.place;
  const std::string extension = Extension(path);
  if (extension == "usda") {
    return WriteFileAtomically(path, [&](std::ostream& out) {
      return WriteUsdSurface(surface, surface.max_level, place, context, out);
    });
  }
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh mesh,
                           Tessellate(surface, surface.max_level, context));
  const std::string warning = RoundingWarning(extension, mesh.vertices, place);
  if (!warning.empty()) std::cerr << Wrap(absl::StrCat(path, ": ", warning), 2) << '\n';
  PointLayers layers;
  layers.colors = surface.colors;
  return WriteMesh(path, extension, mesh, SourcesAtLevel(surface, surface.max_level), layers,
                   place);
}

absl::Status WriteDss(const std::string& path, std::span<const uint8_t> dss) {
  return WithExitCode(WriteBytesAtomically(path, dss), ExitCode::kOutput);
}

}  // namespace

CLI::Option* AddSurfaceOutput(CLI::App* app, const std::string& what,
                              SurfaceOutputArguments* arguments) {
  CLI::Option* output = app->add_option(
      "-o,--output", arguments->output,
      absl::StrCat("the surface, a .dss file; or a mesh of it at its finest level: .ply, .obj, "
                   ".stl, .glb, .3mf, .usda; ",
                   what, "- is standard output (.dss)"));
  app->add_flag("--keep-dss", arguments->keep_dss,
                "with a mesh as the output: keep the .dss file beside it");
  return output;
}

bool SurfaceTarget::is_mesh() const { return IsMesh(Extension(path)); }

absl::StatusOr<SurfaceTarget> SurfaceTargetOf(const SurfaceOutputArguments& arguments) {
  const std::string& path = arguments.output;
  const std::string extension = Extension(path);
  if (IsMesh(extension)) {
    return SurfaceTarget{
        path, arguments.keep_dss ? fs::path(path).replace_extension(".dss").string() : ""};
  }
  // .stream: what test benches that compare several programs call their compact files.
  if (!extension.empty() && extension != "dss" && extension != "stream") {
    return UsageError(absl::StrCat("--output ", path, ": .", extension,
                                   " is not known; write .dss for the surface, or .ply, .obj, "
                                   ".stl, .glb, .3mf or .usda for a mesh of it"));
  }
  if (arguments.keep_dss) {
    return UsageError(
        absl::StrCat("--keep-dss: the output ", path,
                     " is the .dss itself; leave --keep-dss out, or name a mesh as the output"));
  }
  return SurfaceTarget{path, ""};
}

absl::StatusOr<std::vector<SurfaceTarget>> SurfaceTargets(const std::vector<std::string>& scans,
                                                          const SurfaceOutputArguments& arguments) {
  const std::string& output = arguments.output;
  RILIEVO_RETURN_IF_ERROR(CheckFiles({.inputs = scans}));
  std::vector<SurfaceTarget> targets;
  if (!NamesAFolder(output)) {
    if (scans.size() > 1) {
      return UsageError(absl::StrCat("--output ", output, ": ", scans.size(),
                                     " inputs need a folder; write ", output, "/"));
    }
    RILIEVO_ASSIGN_OR_RETURN(targets.emplace_back(), SurfaceTargetOf(arguments));
    return targets;
  }
  if (arguments.keep_dss) {
    return UsageError("--keep-dss: the files in a folder are .dss files; leave --keep-dss out");
  }
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<std::string> paths,
                           PathsInFolder(scans, output, ".dss"));
  for (const std::string& path : paths) targets.push_back({path, ""});
  return targets;
}

std::vector<std::string> PathsOf(const std::vector<SurfaceTarget>& targets) {
  std::vector<std::string> paths;
  for (const SurfaceTarget& target : targets) {
    paths.push_back(target.path);
    if (!target.kept_dss.empty()) paths.push_back(target.kept_dss);
  }
  return paths;
}

absl::Status WriteSurface(const SurfaceTarget& target, std::span<const uint8_t> dss,
                          const RunContext& context) {
  if (!target.is_mesh()) return WriteDss(target.path, dss);
  // The .dss first: what took the time is kept whatever becomes of the mesh.
  if (!target.kept_dss.empty()) RILIEVO_RETURN_IF_ERROR(WriteDss(target.kept_dss, dss));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, DecodeDss(dss, context));
  return WriteSurfaceMesh(decoded, target.path, context);
}

absl::Status WriteSurfaceMesh(const DecodedSurface& decoded, const std::string& path,
                              const RunContext& context) {
  absl::Status written = WriteMeshOf(decoded, path, context);
  if (absl::IsCancelled(written)) return written;
  return WithExitCode(std::move(written), ExitCode::kOutput);
}

}  // namespace rilievo
