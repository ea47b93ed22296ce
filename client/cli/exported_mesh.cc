#include "client/cli/exported_mesh.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/cli/length_words.h"
#include "client/cli/region_words.h"
#include "client/formats/carried_layers.h"
#include "client/formats/textured_mesh.h"
#include "core/base/status_macros.h"
#include "core/codec/container/decode_region.h"
#include "core/surface/displaced_surface.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

absl::StatusOr<AdaptiveOptions> AdaptiveOptionsOf(const ExportArguments& arguments,
                                                  const SpatialFrame& frame,
                                                  const ScanPlace& place) {
  AdaptiveOptions options = arguments.adaptive;
  if (arguments.tolerance.empty()) {
    if (!options.triangles) options.tolerance = 1e-3;  // with a camera
    return options;
  }
  RILIEVO_ASSIGN_OR_RETURN(options.tolerance, ToleranceOf(arguments, frame, place));
  return options;
}

}  // namespace

absl::StatusOr<double> ToleranceOf(const ExportArguments& arguments, const SpatialFrame& frame,
                                   const ScanPlace& place) {
  RILIEVO_ASSIGN_OR_RETURN(const Length length, ParseLength(arguments.tolerance));
  if (length.of == Length::Of::kDiagonal) return length.value;
  if (arguments.adaptive.camera) {
    return UsageError(absl::StrCat("--tolerance ", length.text,
                                   ": with --camera it is a fraction of the distance from there; "
                                   "write one, such as 0.001"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const double units,
                           InScanUnits(length, place, "--tolerance", arguments.input));
  return units / frame.diagonal;
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

absl::StatusOr<PointLayers> Carried(const ExportArguments& arguments,
                                    const Eigen::Matrix3Xd& vertices, const RunContext& context) {
  const std::string& path = arguments.carry;
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile scan,
                           LoadScan(path, arguments.scan, {.intensity = true, .colors = true}));
  absl::StatusOr<PointLayers> layers = LayersAt(vertices, scan, context);
  if (layers.ok()) return layers;
  return AtPath(path, layers.status());
}

}  // namespace rilievo
