#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/exported_mesh.h"
#include "client/cli/length_words.h"
#include "client/cli/output_folder.h"
#include "client/cli/output_target.h"
#include "client/cli/step_output.h"
#include "client/formats/atomic_file.h"
#include "client/formats/file_kind.h"
#include "client/formats/glb_writer.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/meshopt/compress_glb.h"
#include "client/formats/surface_writer.h"
#include "client/formats/tiles/tileset_writer.h"
#include "core/base/status_macros.h"
#include "core/bicubic/bicubic_shell.h"
#include "core/surface/displaced_surface.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

// What was written, in words or as JSON.
void SayExported(const ExportArguments& arguments, std::string what, const Eigen::Vector3d& origin,
                 const std::string& warning, nlohmann::ordered_json facts) {
  if (arguments.json) {
    facts["origin"] = {origin.x(), origin.y(), origin.z()};
    facts["warnings"] = nlohmann::ordered_json::array();
    if (!warning.empty()) facts["warnings"].push_back(warning);
    facts["output"] = arguments.output;
    std::cout << facts.dump(2) << '\n';
    return;
  }
  if (!arguments.place.origin.empty()) {
    absl::StrAppend(&what, ", 0 0 0 being ",
                    absl::StrFormat("%.15g %.15g %.15g", origin.x(), origin.y(), origin.z()));
  }
  std::ostream& out = WordsBeside(arguments.output);
  out << Wrap(absl::StrCat(arguments.output, ": ", what), 2) << '\n';
  if (!warning.empty()) out << LabelledLine("warning", warning);
}

// What is written into a folder.
constexpr char kTiles[] = "3D Tiles";

// Also what .stp stands for.
constexpr char kStep[] = "step";

// Formats that hold the surface itself, or all its levels: they have levels only.
bool HoldsSurface(const std::string& format) {
  return format == "usda" || format == "png" || format == kTiles;
}

absl::Status CheckFormat(const ExportArguments& arguments, const std::string& format) {
  const std::set<std::string> others = {"ply", "obj", "stl", "glb", "3mf", kStep};
  std::string problem;
  if (!HoldsSurface(format) && !others.contains(format)) {
    problem =
        "the extension must be .ply, .obj, .stl, .glb, .3mf, .step, .usda or .png; a folder (DIR/) "
        "gets 3D Tiles";
  } else if (format == kStep &&
             (arguments.level || arguments.adaptive.triangles || arguments.adaptive.camera ||
              arguments.cage || !arguments.region.empty())) {
    problem = ".step has patches; it takes --tolerance alone";
  } else if (HoldsSurface(format) && (arguments.adapts() || arguments.cage ||
                                      !arguments.carry.empty() || !arguments.region.empty())) {
    problem = absl::StrCat(format == kTiles ? "" : ".", format, " takes --level alone");
  } else if (arguments.texture && format != "glb") {
    problem = "only .glb can have a --texture";
  } else if (arguments.compress && format != "glb" && format != kTiles) {
    problem = "only .glb and 3D Tiles can be compressed; leave --compress out";
  } else if (!arguments.carry.empty() && format != "ply" && format != "glb") {
    problem = "only .ply and .glb can --carry colours and intensity";
  }
  if (problem.empty()) return CheckExportPlace(arguments.place, arguments.output, format);
  return UsageError(absl::StrCat(arguments.output, ": ", problem));
}

absl::Status WriteHeights(const DisplacedSurface& surface, int level, const ScanPlace& place,
                          const ExportArguments& arguments, const std::string& format,
                          const RunContext& context) {
  return WriteFileAtomically(arguments.output, [&](std::ostream& out) {
    return format == "usda" ? WriteUsdSurface(surface, level, place, context, out)
                            : WriteDisplacementAtlas(surface, level, context, out);
  });
}

absl::Status ExportSurface(DecodedSurface decoded, const ExportArguments& arguments,
                           const std::string& format, const RunContext& context) {
  DisplacedSurface& surface = decoded.surface;
  const int level = arguments.level.value_or(surface.max_level);
  if (level > surface.max_level) {
    return UsageError(absl::StrCat("--level ", level, ": ", format,
                                   " holds heights, and the surface has those of level 0 to ",
                                   surface.max_level));
  }
  const ScanPlace place = PlaceOf(arguments.place.place, decoded.metadata.place);
  RILIEVO_ASSIGN_OR_RETURN(const Eigen::Vector3d origin, OriginOf(arguments.place, surface.frame));
  surface.frame.center -= origin;
  std::string what =
      absl::StrCat("level ", level, ", ",
                   Counted(surface.control_mesh.faces.cols(), "control face", "control faces"));
  nlohmann::ordered_json facts = {{"level", level},
                                  {"control_faces", surface.control_mesh.faces.cols()}};
  if (format == kTiles) {
    const absl::StatusOr<WrittenTileset> written =
        WriteTileset(arguments.output, surface, place,
                     {.finest_level = level, .compressed = arguments.compress}, context);
    RILIEVO_RETURN_IF_ERROR(WithExitCode(written.status(), ExitCode::kOutput));
    absl::StrAppend(&what, ", tileset.json and ", Counted(written->tiles, "tile", "tiles"), ", ",
                    Counted(written->triangles, "face", "faces"), " at the finest level");
    facts["tiles"] = written->tiles;
    facts["faces"] = written->triangles;
    facts["bytes"] = written->bytes;
  } else {
    RILIEVO_RETURN_IF_ERROR(WithExitCode(
        WriteHeights(surface, level, place, arguments, format, context), ExitCode::kOutput));
  }
  SayExported(arguments, what, origin, "", facts);
  return absl::OkStatus();
}

absl::Status ExportStep(const DecodedSurface& decoded, const ExportArguments& arguments,
                        const RunContext& context) {
  DisplacedSurface surface = decoded.surface;
  const ScanPlace place = PlaceOf(arguments.place.place, decoded.metadata.place);
  BicubicOptions options;
  if (!arguments.tolerance.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(options.tolerance, ToleranceOf(arguments, surface.frame, place));
  }
  RILIEVO_ASSIGN_OR_RETURN(const Eigen::Vector3d origin, OriginOf(arguments.place, surface.frame));
  surface.frame.center -= origin;
  RILIEVO_ASSIGN_OR_RETURN(BicubicShell shell, FitBicubicShell(surface, options, context));
  const auto patches = static_cast<int64_t>(shell.patches.size());
  const double error = shell.error;
  RILIEVO_RETURN_IF_ERROR(
      WithExitCode(WriteStep(arguments.output, std::move(shell), place, surface.frame.diagonal),
                   ExitCode::kOutput));
  std::string warning;
  if (error > options.tolerance) {
    warning =
        absl::StrCat("patches are up to ", Percent(error), " of the diagonal off, and not ",
                     Percent(options.tolerance), ": some relief is finer than patches can be");
  }
  SayExported(arguments,
              absl::StrCat(Counted(patches, "bicubic patch", "bicubic patches"), " within ",
                           Percent(error), " of the diagonal"),
              origin, warning, {{"patches", patches}, {"error", error}});
  return absl::OkStatus();
}

absl::Status WriteExported(const DisplacedSurface& surface, const ExportArguments& arguments,
                           const ExportedMesh& exported, const std::string& extension) {
  if (arguments.cage && extension == "obj") {  // the one mesh format that can tell the creases
    return WriteFileAtomically(arguments.output, [&](std::ostream& out) {
      return WriteObjCage(surface.control_mesh, exported.frame, out);
    });
  }
  if (extension == "glb") {
    const GlbTexture texture{exported.texture, exported.png};
    const GlbTexture* const shown = exported.png.empty() ? nullptr : &texture;
    return WriteFileAtomically(arguments.output, [&](std::ostream& out) {
      return arguments.compress ? WriteCompressedGlbMesh(exported.mesh, exported.sources, out,
                                                         exported.layers, exported.place, shown)
                                : WriteGlbMesh(exported.mesh, exported.sources, out,
                                               exported.layers, exported.place, shown);
    });
  }
  return WriteMesh(arguments.output, extension, exported.mesh, exported.sources, exported.layers,
                   exported.place);
}

absl::Status WriteAndSay(const DisplacedSurface& surface, const ExportArguments& arguments,
                         ExportedMesh exported, const std::string& extension,
                         const RunContext& context) {
  if (!arguments.carry.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(PointLayers carried,
                             Carried(arguments, exported.mesh.vertices, context));
    if (carried.colors.empty()) carried.colors = std::move(exported.layers.colors);
    exported.layers = std::move(carried);
  }
  RILIEVO_ASSIGN_OR_RETURN(const Eigen::Vector3d origin, OriginOf(arguments.place, exported.frame));
  exported.mesh.vertices.colwise() -= origin;
  exported.frame.center -= origin;
  RILIEVO_RETURN_IF_ERROR(
      WithExitCode(WriteExported(surface, arguments, exported, extension), ExitCode::kOutput));
  const TriangleMesh& mesh = exported.mesh;
  const ControlMesh& control = surface.control_mesh;
  const bool of_quads = arguments.cage && extension == "obj" && control.quads();
  const int64_t faces =
      of_quads ? static_cast<int64_t>(control.diagonals.size()) : int64_t{mesh.triangles.cols()};
  SayExported(
      arguments,
      absl::StrCat(exported.how, ", ", Counted(mesh.vertices.cols(), "vertex", "vertices"), ", ",
                   of_quads ? Counted(faces, "quad", "quads") : Counted(faces, "face", "faces")),
      origin, RoundingWarning(extension, mesh.vertices, exported.place),
      {{"kind", exported.how}, {"vertices", mesh.vertices.cols()}, {"faces", faces}});
  return absl::OkStatus();
}

std::string FormatOf(const ExportArguments& arguments) {
  if (IsStandardOutput(arguments.output)) return arguments.format;
  if (NamesAFolder(arguments.output)) return kTiles;
  const std::string extension = Extension(arguments.output);
  return extension == "stp" ? kStep : extension;
}

// Its tileset.json stands for the files of a folder.
std::string FileOf(const std::string& output, const std::string& format) {
  return format == kTiles ? absl::StrCat(output, "/tileset.json") : output;
}

absl::Status Export(const ExportArguments& arguments, std::stop_token stop) {
  const std::string format = FormatOf(arguments);
  RILIEVO_RETURN_IF_ERROR(CheckFormat(arguments, format));
  if (format == kTiles) RILIEVO_RETURN_IF_ERROR(MakeOutputFolder(arguments.output));
  if (format == kStep) RILIEVO_RETURN_IF_ERROR(CheckStepLibrary());
  RILIEVO_RETURN_IF_ERROR(CheckFiles({{arguments.input, arguments.carry},
                                      {FileOf(arguments.output, format)},
                                      {arguments.json ? "-" : ""}}));
  RunContext context;
  context.stop = stop;
  if (!arguments.region.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(arguments.input));
    RILIEVO_ASSIGN_OR_RETURN(const ExportedMesh part, RegionOf(bytes, arguments, context));
    return WriteAndSay({}, arguments, part, format, context);
  }
  RILIEVO_ASSIGN_OR_RETURN(DecodedSurface decoded, LoadDss(arguments.input, context));
  if (format == kStep) return ExportStep(decoded, arguments, context);
  if (HoldsSurface(format)) return ExportSurface(std::move(decoded), arguments, format, context);
  RILIEVO_ASSIGN_OR_RETURN(ExportedMesh exported, MeshOf(decoded, arguments, context));
  return WriteAndSay(decoded.surface, arguments, std::move(exported), format, context);
}

}  // namespace

Command AddExport(CLI::App& program) {
  CLI::App* app = program.add_subcommand("export", "Write a surface as a mesh, or for CAD");
  const auto arguments = std::make_shared<ExportArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file; - is standard input")
      ->required();
  app->add_option(
         "OUT", arguments->output,
         "the mesh: .ply (with normals and, per vertex, where its height comes from: 0 "
         "measured, 1 smoothed, 2 filled in), .obj, .stl, .glb or .3mf; bicubic patches for "
         "CAD: .step; the subdivision surface with its heights: .usda; the heights alone as a "
         "16-bit picture: .png; "
         "all levels as 3D Tiles, for maps and viewers that load what they show: a folder "
         "(DIR/); - is standard output")
      ->required();
  app->add_option("--format", arguments->format, "format of the standard output")
      ->check(CLI::IsMember({"ply", "obj", "stl", "glb", "3mf", "step", "usda", "png"}))
      ->capture_default_str();
  app->add_flag("--json", arguments->json, "print JSON");
  app->add_option("--level", arguments->level,
                  "level of detail, 0 the coarsest; default the finest")
      ->check(CLI::Range(0, 10));
  CLI::Option* level = app->get_option("--level");
  CLI::Option* tolerance =
      app->add_option(
             "--tolerance", arguments->tolerance,
             "largest distance from the finest level, with as few triangles as possible: "
             "0.5mm, 0.02u (the scan's own units), 0.1% or 0.001 (of the diagonal); of .step "
             "that of its patches, default 0.05%")
          ->check(IsLength(0, 1))
          ->excludes(level);
  app->add_option("--triangles", arguments->adaptive.triangles,
                  "largest number of triangles, placed where they reduce the error most")
      ->check(CLI::Range(int64_t{1}, int64_t{1} << 40))
      ->excludes(level)
      ->excludes(tolerance);
  app->add_option("--region", arguments->region,
                  "some control faces alone: their numbers (17, 0-99) or a box in the scan's "
                  "coordinates (box:X,Y,Z,X,Y,Z); several make one region. Large surfaces are then "
                  "decoded there only")
      ->excludes(tolerance)
      ->excludes("--triangles");
  app->add_flag("--cage", arguments->cage,
                "the control mesh itself; .obj holds its creases too, as OpenSubdiv's tags")
      ->excludes(level)
      ->excludes(tolerance)
      ->excludes("--triangles")
      ->excludes("--region");
  app->add_option(
         "--texture", arguments->texture,
         ".glb: the colours as a picture of at most so many pixels each way, which a coarse "
         "--level shows as well as a fine one; 2048 suits most programs")
      ->check(CLI::Range(16, 16384))
      ->excludes(tolerance)
      ->excludes("--triangles")
      ->excludes("--region")
      ->excludes("--cage");
  app->add_flag("--compress", arguments->compress,
                ".glb and 3D Tiles: a seventh of the bytes, for programs that know "
                "EXT_meshopt_compression (three.js, Babylon.js, Cesium); no vertex moves by more "
                "than 2^-16 of the diagonal");
  app->add_option(
         "--carry", arguments->carry,
         "a scan whose colours and intensity the vertices take from their nearest points; .ply and "
         ".glb")
      ->excludes("--texture");
  AddScanOptions(app, &arguments->scan);
  AddExportPlace(app, &arguments->place);
  app->add_option("--camera", arguments->camera,
                  "seen from this place, X Y Z in the scan's coordinates: the tolerance is then a "
                  "fraction of the distance from there, 0.001 (a pixel of 1080 over 60 degrees) "
                  "unless --tolerance or --triangles are given")
      ->expected(3)
      ->excludes(level)
      ->excludes("--cage")
      ->excludes("--region")
      ->excludes("--texture");
  return {app, [arguments](std::stop_token stop) {
            if (!arguments->camera.empty()) {
              arguments->adaptive.camera = Eigen::Vector3d(arguments->camera.data());
            }
            return Export(*arguments, stop);
          }};
}

}  // namespace rilievo
