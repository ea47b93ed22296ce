#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/export_place.h"
#include "client/cli/length_words.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/region_words.h"
#include "client/formats/atomic_file.h"
#include "client/formats/carried_layers.h"
#include "client/formats/file_kind.h"
#include "client/formats/glb_writer.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/scan_reader.h"
#include "client/formats/surface_writer.h"
#include "client/formats/textured_mesh.h"
#include "core/base/status_macros.h"
#include "core/codec/container/decode_region.h"
#include "core/surface/adaptive_tessellation.h"
#include "core/surface/displaced_surface.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

struct ExportArguments {
  std::string input, output, format = "ply";
  std::optional<int> level;
  std::string tolerance;  // see length_words.h
  AdaptiveOptions adaptive;
  ExportPlaceArguments place;
  bool cage = false, json = false;
  std::vector<double> camera;  // x, y, z, or empty
  std::string carry;           // a scan
  std::optional<int> texture;  // pixels
  ScanArguments scan;
  std::vector<std::string> region;

  bool adapts() const { return !tolerance.empty() || adaptive.triangles || adaptive.camera; }
};

struct ExportedMesh {
  TriangleMesh mesh;
  std::vector<HeightSource> sources;
  PointLayers layers;
  Eigen::Matrix2Xf texture;  // with --texture
  std::string png;
  std::string how;  // for people
  SpatialFrame frame;
  ScanPlace place;
};

// The tolerance as a fraction, of the diagonal or of the distance from the camera.
absl::StatusOr<AdaptiveOptions> AdaptiveOptionsOf(const ExportArguments& arguments,
                                                  const SpatialFrame& frame,
                                                  const ScanPlace& place) {
  AdaptiveOptions options = arguments.adaptive;
  if (arguments.tolerance.empty()) {
    if (!options.triangles) options.tolerance = 1e-3;  // with a camera
    return options;
  }
  RILIEVO_ASSIGN_OR_RETURN(const Length length, ParseLength(arguments.tolerance));
  if (length.of == Length::Of::kDiagonal) {
    options.tolerance = length.value;
    return options;
  }
  if (options.camera) {
    return UsageError(absl::StrCat("--tolerance ", length.text,
                                   ": with --camera it is a fraction of the distance from there; "
                                   "write one, such as 0.001"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const double units,
                           InScanUnits(length, place, "--tolerance", arguments.input));
  options.tolerance = units / frame.diagonal;
  return options;
}

absl::StatusOr<ExportedMesh> MeshOf(const DecodedSurface& decoded, const ExportArguments& arguments,
                                    const RunContext& context) {
  const DisplacedSurface& surface = decoded.surface;
  ExportedMesh exported;
  exported.frame = surface.frame;
  exported.place = PlaceOf(arguments.place.place, decoded.metadata.place);
  if (arguments.cage) {
    const ControlMesh& control = surface.control_mesh;
    exported.mesh.vertices =
        (control.vertices * surface.frame.diagonal).colwise() + surface.frame.center;
    exported.mesh.triangles = control.faces;
    exported.how = "control mesh";
    return exported;
  }
  if (arguments.texture) {
    const int level = arguments.level.value_or(surface.max_level);
    RILIEVO_ASSIGN_OR_RETURN(TexturedMesh textured,
                             MakeTexturedMesh(surface, level, *arguments.texture, context));
    exported.how =
        absl::StrCat("level ", level, " with the colours of level ", textured.texture_level, " in ",
                     textured.width, " x ", textured.height, " pixels");
    exported.mesh = std::move(textured.mesh);
    exported.sources = std::move(textured.sources);
    exported.texture = std::move(textured.texture);
    exported.png = std::move(textured.png);
    return exported;
  }
  if (!arguments.adapts()) {
    const int level = arguments.level.value_or(surface.max_level);
    RILIEVO_ASSIGN_OR_RETURN(exported.mesh, Tessellate(surface, level, context));
    exported.sources = SourcesAtLevel(surface, level);
    exported.layers.colors = ColorsAtLevel(surface, level);
    exported.how = absl::StrCat("level ", level);
    return exported;
  }
  RILIEVO_ASSIGN_OR_RETURN(const AdaptiveOptions options,
                           AdaptiveOptionsOf(arguments, surface.frame, exported.place));
  absl::StatusOr<AdaptiveMesh> made = TessellateAdaptively(surface, options, context);
  if (absl::IsInvalidArgument(made.status())) {  // it begins with the name of an option
    return absl::InvalidArgumentError(absl::StrCat("--", made.status().message()));
  }
  RILIEVO_ASSIGN_OR_RETURN(AdaptiveMesh adaptive, std::move(made));
  exported.mesh = std::move(adaptive.mesh);
  for (int v : adaptive.vertices) {
    exported.sources.push_back(surface.sources[v]);
    if (!surface.colors.empty()) exported.layers.colors.push_back(surface.colors[v]);
  }
  exported.how =
      absl::StrCat("within ", Percent(adaptive.error),
                   options.camera ? " of its distance from the camera" : " of the diagonal",
                   " of level ", surface.max_level);
  return exported;
}

// Only what the region depends on is decoded: the control mesh, to see which faces those are, and
// then they.
absl::StatusOr<ExportedMesh> RegionOf(const std::vector<uint8_t>& bytes,
                                      const ExportArguments& arguments, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const RegionWords words, ReadRegionWords(arguments.region));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface control, DecodeControlChunk(bytes, context));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<int> faces, FacesNamed(words, control));
  RILIEVO_ASSIGN_OR_RETURN(
      DecodedRegion part,
      DecodeRegion(bytes, faces, arguments.level.value_or(kFinestLevel), context));
  ExportedMesh exported;
  exported.frame = control.surface.frame;
  exported.place = PlaceOf(arguments.place.place, control.metadata.place);
  exported.mesh = std::move(part.region.mesh);
  exported.sources = std::move(part.sources);
  exported.layers.colors = std::move(part.colors);
  exported.how =
      absl::StrCat("level ", part.level, " of ",
                   Counted(static_cast<int64_t>(faces.size()), "control face", "control faces"));
  if (part.groups > 0) {
    absl::StrAppend(&exported.how, " (", part.groups_read, " of ", part.groups, " groups decoded)");
  }
  return exported;
}

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

// Formats that hold the surface itself, not triangles of it: they have levels only.
bool HoldsSurface(const std::string& extension) {
  return extension == "usda" || extension == "png";
}

absl::Status CheckFormat(const ExportArguments& arguments, const std::string& extension) {
  const std::set<std::string> meshes = {"ply", "obj", "stl", "glb"};
  std::string problem;
  if (!HoldsSurface(extension) && !meshes.contains(extension)) {
    problem = "the extension must be .ply, .obj, .stl, .glb, .usda or .png";
  } else if (HoldsSurface(extension) && (arguments.adapts() || arguments.cage ||
                                         !arguments.carry.empty() || !arguments.region.empty())) {
    problem = absl::StrCat(".", extension, " takes --level alone");
  } else if (arguments.texture && extension != "glb") {
    problem = "only .glb can have a --texture";
  } else if (!arguments.carry.empty() && extension != "ply" && extension != "glb") {
    problem = "only .ply and .glb can --carry colours and intensity";
  }
  if (problem.empty()) return CheckExportPlace(arguments.place, arguments.output, extension);
  return UsageError(absl::StrCat(arguments.output, ": ", problem));
}

absl::Status ExportSurface(DecodedSurface decoded, const ExportArguments& arguments,
                           const std::string& extension, const RunContext& context) {
  DisplacedSurface& surface = decoded.surface;
  const int level = arguments.level.value_or(surface.max_level);
  if (level > surface.max_level) {
    return WithExitCode(
        absl::InvalidArgumentError(absl::StrCat(
            "--level ", level, ": .", extension,
            " holds heights, and the surface has those of level 0 to ", surface.max_level)),
        ExitCode::kUsage);
  }
  const ScanPlace place = PlaceOf(arguments.place.place, decoded.metadata.place);
  RILIEVO_ASSIGN_OR_RETURN(const Eigen::Vector3d origin, OriginOf(arguments.place, surface.frame));
  surface.frame.center -= origin;
  const absl::Status written = WriteFileAtomically(arguments.output, [&](std::ostream& out) {
    return extension == "usda" ? WriteUsdSurface(surface, level, place, context, out)
                               : WriteDisplacementAtlas(surface, level, context, out);
  });
  RILIEVO_RETURN_IF_ERROR(WithExitCode(written, ExitCode::kOutput));
  SayExported(
      arguments,
      absl::StrCat("level ", level, ", ",
                   Counted(surface.control_mesh.faces.cols(), "control face", "control faces")),
      origin, "", {{"level", level}, {"control_faces", surface.control_mesh.faces.cols()}});
  return absl::OkStatus();
}

absl::StatusOr<PointLayers> Carried(const ExportArguments& arguments,
                                    const Eigen::Matrix3Xd& vertices, const RunContext& context) {
  const std::string& path = arguments.carry;
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile scan,
                           LoadScan(path, arguments.scan, {.intensity = true, .colors = true}));
  absl::StatusOr<PointLayers> layers = LayersAt(vertices, scan, context);
  if (layers.ok()) return layers;
  return absl::Status(layers.status().code(), absl::StrCat(path, ": ", layers.status().message()));
}

absl::Status WriteExported(const DisplacedSurface& surface, const ExportArguments& arguments,
                           const ExportedMesh& exported, const std::string& extension) {
  if (arguments.cage && extension == "obj") {  // the one mesh format that can tell the creases
    return WriteFileAtomically(arguments.output, [&](std::ostream& out) {
      return WriteObjCage(surface.control_mesh, exported.frame, out);
    });
  }
  if (!exported.png.empty()) {
    const GlbTexture texture{exported.texture, exported.png};
    return WriteFileAtomically(arguments.output, [&](std::ostream& out) {
      return WriteGlbMesh(exported.mesh, exported.sources, out, {}, exported.place, &texture);
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
  SayExported(arguments,
              absl::StrCat(exported.how, ", ", Counted(mesh.vertices.cols(), "vertex", "vertices"),
                           ", ", Counted(mesh.triangles.cols(), "face", "faces")),
              origin, RoundingWarning(extension, mesh.vertices, exported.place),
              {{"kind", exported.how},
               {"vertices", mesh.vertices.cols()},
               {"faces", mesh.triangles.cols()}});
  return absl::OkStatus();
}

absl::Status Export(const ExportArguments& arguments, std::stop_token stop) {
  const std::string extension =
      IsStandardOutput(arguments.output) ? arguments.format : Extension(arguments.output);
  RILIEVO_RETURN_IF_ERROR(CheckFormat(arguments, extension));
  RILIEVO_RETURN_IF_ERROR(CheckFiles(
      {{arguments.input, arguments.carry}, {arguments.output}, {arguments.json ? "-" : ""}}));
  RunContext context;
  context.stop = stop;
  if (!arguments.region.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(arguments.input));
    RILIEVO_ASSIGN_OR_RETURN(const ExportedMesh part, RegionOf(bytes, arguments, context));
    return WriteAndSay({}, arguments, part, extension, context);
  }
  RILIEVO_ASSIGN_OR_RETURN(DecodedSurface decoded, LoadDss(arguments.input, context));
  if (HoldsSurface(extension)) {
    return ExportSurface(std::move(decoded), arguments, extension, context);
  }
  RILIEVO_ASSIGN_OR_RETURN(ExportedMesh exported, MeshOf(decoded, arguments, context));
  return WriteAndSay(decoded.surface, arguments, std::move(exported), extension, context);
}

}  // namespace

Command AddExport(CLI::App& program) {
  CLI::App* app = program.add_subcommand("export", "Write a surface as a mesh");
  const auto arguments = std::make_shared<ExportArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file; - is standard input")
      ->required();
  app->add_option("OUT", arguments->output,
                  "the mesh: .ply (with normals and, per vertex, where its height comes from: 0 "
                  "measured, 1 smoothed, 2 filled in), .obj, .stl or .glb; the subdivision surface "
                  "with its heights: .usda; the heights alone as a 16-bit picture: .png; - is "
                  "standard output")
      ->required();
  app->add_option("--format", arguments->format, "format of the standard output")
      ->check(CLI::IsMember({"ply", "obj", "stl", "glb", "usda", "png"}))
      ->capture_default_str();
  app->add_flag("--json", arguments->json, "print JSON");
  app->add_option("--level", arguments->level,
                  "level of detail, 0 the coarsest; default the finest")
      ->check(CLI::Range(0, 10));
  CLI::Option* level = app->get_option("--level");
  CLI::Option* tolerance =
      app->add_option("--tolerance", arguments->tolerance,
                      "largest distance from the finest level, with as few triangles as possible: "
                      "0.5mm, 0.02u (the scan's own units), 0.1% or 0.001 (of the diagonal)")
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
