#include "client/cli/reconstruct_options.h"

#include <map>

#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/cli/length_words.h"
#include "client/formats/intensity_colors.h"
#include "client/formats/mesh_reader.h"
#include "core/base/status_macros.h"
#include "core/control/control_options.h"
#include "core/control/settings.h"
#include "core/geometry/point_records.h"
#include "core/loop/crease_topology.h"
#include "server/conversion/convert_place.h"

namespace rilievo {
namespace {

// The given mesh as the protocol carries it, scan frame, with the creases and corners of an OBJ.
absl::StatusOr<v1::ControlMesh> ReadControlMesh(const std::string& path) {
  RILIEVO_ASSIGN_OR_RETURN(MeshFile file, ReadMesh(path));
  if (file.mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": holds no faces; the control mesh must be a triangle mesh (OBJ, PLY, STL)"));
  }
  v1::ControlMesh mesh;
  mesh.set_positions(PackPoints({file.mesh.vertices}, 0, file.mesh.vertices.cols(),
                                {.coordinates = CoordinateType::kFloat64}));
  for (Eigen::Index i = 0; i < file.mesh.triangles.size(); ++i) {
    mesh.add_faces(static_cast<uint32_t>(file.mesh.triangles.data()[i]));
  }
  if (!file.tags) return mesh;
  SortTags(&file.tags->creases, &file.tags->corners);
  for (const Crease& crease : file.tags->creases) {
    mesh.add_creases(static_cast<uint32_t>(crease.a));
    mesh.add_creases(static_cast<uint32_t>(crease.b));
    mesh.add_sharpness(crease.sharpness);
  }
  for (const int corner : file.tags->corners) mesh.add_corners(static_cast<uint32_t>(corner));
  return mesh;
}

v1::SightRule SightRuleOf(const std::string& word) {
  if (word == "auto") return v1::SIGHT_RULE_AUTO;
  return word == "use" ? v1::SIGHT_RULE_USE : v1::SIGHT_RULE_IGNORE;
}

// What a mesh brings along, and points do not.
void AddScanShapeOptions(CLI::App* app, ReconstructArguments* a) {
  app->add_option("--topology", a->topology,
                  "shape of the surface: auto, planar (one sheet over a plane), spherical "
                  "(star-shaped) or arbitrary")
      ->check(CLI::IsMember({"auto", "planar", "spherical", "arbitrary"}))
      ->capture_default_str();
  CLI::Option* mesh =
      app->add_option("--control-mesh", a->control_mesh,
                      "start from this triangle mesh (OBJ, PLY, STL), in the scan's coordinates, "
                      "with the creases of an OBJ ('t crease')");
  app->get_option("--topology")->excludes(mesh);
  app->get_option("--control-faces")->excludes(mesh);
  app->add_option(
         "--boundary", a->boundary,
         "keep an open scan open, or close it; a sheet over a plane keeps its outer border")
      ->check(CLI::IsMember({"keep", "close"}))
      ->capture_default_str();
  app->add_option("--outliers", a->outliers,
                  "whether points off all others, small islands, and points that fill volumes as "
                  "leaves do, are left out (remove) or are part of the surface (keep)")
      ->check(CLI::IsMember({"remove", "keep"}))
      ->capture_default_str();
  app->add_option("--stations", a->stations,
                  "whether the surface faces the places that its points were seen from, where the "
                  "scan tells them: auto (when believable), use (without a check) or ignore")
      ->check(CLI::IsMember({"auto", "use", "ignore"}))
      ->capture_default_str();
  app->add_option("--normals", a->normals,
                  "the same for the side of the normals that the scan gives")
      ->check(CLI::IsMember({"auto", "use", "ignore"}))
      ->capture_default_str();
}

}  // namespace

void AddReconstructOptions(CLI::App* app, ShapeInput input, ReconstructArguments* a) {
  a->input = input;
  const bool is_scan = input == ShapeInput::kScan;
  const std::string thing = is_scan ? "scan" : "mesh";
  app->add_option(
         "--colors", a->colors,
         absl::StrCat("auto: the surface has the colours of the ", thing, ", where it has any",
                      is_scan ? "; intensity: a grey by the intensity of its points" : "",
                      "; ignore: none"))
      ->check(is_scan ? CLI::IsMember({"auto", "intensity", "ignore"})
                      : CLI::IsMember({"auto", "ignore"}))
      ->capture_default_str();
  app->add_option("--creases", a->creases,
                  absl::StrCat("auto: sharp edges of the ", thing,
                               " become creases of the surface; off: none do"))
      ->check(CLI::IsMember({"auto", "off"}))
      ->capture_default_str();
  app->add_option("--scheme", a->scheme,
                  "scheme of the smooth surface: loop (triangles) or catmull-clark (quads)")
      ->check(CLI::IsMember({"loop", "catmull-clark"}))
      ->capture_default_str();
  app->add_option("--max-level", a->max_level,
                  absl::StrCat("levels of heights; default as many as ",
                               input == ShapeInput::kScan ? "the points are dense enough for"
                                                          : "suit the triangles"))
      ->check(CLI::Range(0, 8));
  app->add_option(
         "--control-faces", a->control_faces,
         absl::StrCat("about how many faces the control mesh has; default chosen from the ",
                      input == ShapeInput::kScan ? "points" : "triangles"))
      ->check(CLI::Range(0, 200000));
  app->add_option("--threads", a->threads, "threads to use; default all")
      ->check(CLI::Range(0, 1024));
  app->add_option(
         "--fit", a->fit,
         "how the smooth surface is fitted: suzuki (fast) or least-squares (closer; default)")
      ->check(CLI::IsMember({"suzuki", "least-squares"}));
  CLI::Option* error =
      app->add_option("--max-error", a->max_error,
                      absl::StrCat("largest RMS distance between the surface and the ",
                                   input == ShapeInput::kScan ? "points" : "mesh",
                                   ": 2cm, 0.5mm, 0.02u (the ", thing,
                                   "'s own units), 0.1% or 0.001 (of the diagonal); a warning says "
                                   "where the ",
                                   thing,
                                   " does not allow it; default chosen so that coding "
                                   "adds little to the error of the surface itself"))
          ->check(IsLength(1e-6, 0.1));
  CLI::Option* bytes =
      app->add_option("--max-bytes", a->max_bytes, "largest size of the .dss file in bytes")
          ->check(CLI::Range(uint64_t{1}, uint64_t{1} << 40))
          ->excludes(error);
  app->add_option("--height-step", a->height_step,
                  "step of the height quantiser, written like --max-error")
      ->check(IsLength(1e-9, 0.01))
      ->excludes(error)
      ->excludes(bytes);
  app->add_option(
         "--close-holes-below", a->close_holes_below,
         "close holes whose rim, once around, is shorter than this, written like "
         "--max-error; larger ones and the outer border of a sheet stay open; default none")
      ->check(IsLength(kControlOptions.shortest_rim, kControlOptions.longest_rim));
  app->add_option("--bridge-gaps-below", a->bridge_gaps_below,
                  "join pieces whose borders run along each other less than this apart, written "
                  "like --max-error; default none")
      ->check(IsLength(kControlOptions.narrowest_gap, kControlOptions.widest_gap));
  if (input == ShapeInput::kScan) {
    AddScanShapeOptions(app, a);
  } else {
    app->add_option("--boundary", a->boundary,
                    "exact: the border of the surface comes to that of the mesh within 1e-5 of the "
                    "diagonal, or a warning says by how much it is missed, in a larger file; "
                    "default keep")
        ->check(CLI::IsMember({"keep", "exact"}));
  }
  AddPlaceOptions(app, &a->place);
  app->add_option("--seed", a->seed, "seed of all random choices; default 0");
  app->add_flag("--no-measure", a->no_measure, "do not measure the error at the end");
}

void AppendFilesOf(const ReconstructArguments& arguments, std::vector<std::string>* files) {
  files->push_back(arguments.control_mesh);
}

WantedLayers LayersFor(const ReconstructArguments& arguments) {
  return {.intensity = arguments.colors == "intensity",
          .colors = arguments.colors == "auto",
          .stations = arguments.stations != "ignore",
          .normals = arguments.normals != "ignore"};
}

absl::Status ColorAsAsked(const ReconstructArguments& arguments, const std::string& name,
                          ScanFile* scan) {
  if (arguments.colors != "intensity") return absl::OkStatus();
  const absl::Status status = ColorByIntensity(scan);
  return status.ok() ? status : WithMessage(status, absl::StrCat(name, ": ", status.message()));
}

absl::StatusOr<v1::ReconstructOptions> OptionsFrom(const ReconstructArguments& arguments) {
  v1::ReconstructOptions options;
  if (arguments.max_level) options.set_max_level(*arguments.max_level);
  if (arguments.threads) options.set_threads(*arguments.threads);
  if (arguments.seed) options.set_seed(*arguments.seed);
  if (arguments.no_measure) options.set_measure(false);
  if (arguments.input == ShapeInput::kScan) {
    options.mutable_scan()->set_stations(SightRuleOf(arguments.stations));
    options.mutable_scan()->set_normals(SightRuleOf(arguments.normals));
    if (arguments.outliers == "keep") {
      options.mutable_scan()->set_outlier_distance_factor(0);
      options.mutable_scan()->set_min_component_share(0);
    }
  }
  v1::ControlOptions& control = *options.mutable_control();
  const std::map<std::string, v1::Topology> topologies = {{"auto", v1::TOPOLOGY_AUTO},
                                                          {"planar", v1::TOPOLOGY_PLANAR},
                                                          {"spherical", v1::TOPOLOGY_SPHERICAL},
                                                          {"arbitrary", v1::TOPOLOGY_ARBITRARY}};
  const std::map<std::string, v1::Boundary> boundaries = {
      {"keep", v1::BOUNDARY_KEEP}, {"close", v1::BOUNDARY_CLOSE}, {"exact", v1::BOUNDARY_EXACT}};
  control.set_boundary(boundaries.at(arguments.boundary));
  control.set_creases(arguments.creases == "auto" ? v1::CREASES_AUTO : v1::CREASES_OFF);
  if (arguments.scheme != "loop") control.set_scheme(v1::SCHEME_CATMULL_CLARK);
  if (arguments.control_faces) control.set_control_faces(*arguments.control_faces);
  if (arguments.control_mesh.empty()) {
    control.set_topology(topologies.at(arguments.topology));
  } else {
    control.set_topology(v1::TOPOLOGY_GIVEN);
    RILIEVO_ASSIGN_OR_RETURN(*control.mutable_control_mesh(),
                             ReadControlMesh(arguments.control_mesh));
  }
  if (!arguments.fit.empty()) {
    options.mutable_fit()->set_method(arguments.fit == "suzuki" ? v1::FIT_METHOD_SUZUKI
                                                                : v1::FIT_METHOD_LEAST_SQUARES);
  }
  if (arguments.max_bytes) options.mutable_encode()->set_max_bytes(*arguments.max_bytes);
  return options;
}

absl::Status SetPlace(const ReconstructArguments& arguments, const std::string& path,
                      const ScanPlace& known, v1::ReconstructOptions* options) {
  const ScanPlace place = PlaceOf(arguments.place, known);
  options->clear_place();
  if (place != ScanPlace()) *options->mutable_place() = ProtoPlace(place);
  v1::EncodeOptions& encode = *options->mutable_encode();
  v1::ControlOptions& control = *options->mutable_control();
  const auto set = [&](const char* option, const std::string& text, auto set_fraction,
                       auto set_length) -> absl::Status {
    if (text.empty()) return absl::OkStatus();
    RILIEVO_ASSIGN_OR_RETURN(const Length length, ParseLength(text));
    if (length.of == Length::Of::kDiagonal) {
      set_fraction(length.value);
      return absl::OkStatus();
    }
    RILIEVO_ASSIGN_OR_RETURN(const double units, InScanUnits(length, place, option, path));
    set_length(units);
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(set(
      "--max-error", arguments.max_error, [&](double v) { encode.set_max_error_ratio(v); },
      [&](double v) { encode.set_max_error_length(v); }));
  RILIEVO_RETURN_IF_ERROR(set(
      "--close-holes-below", arguments.close_holes_below,
      [&](double v) { control.set_close_holes_below_ratio(v); },
      [&](double v) { control.set_close_holes_below_length(v); }));
  RILIEVO_RETURN_IF_ERROR(set(
      "--bridge-gaps-below", arguments.bridge_gaps_below,
      [&](double v) { control.set_bridge_gaps_below_ratio(v); },
      [&](double v) { control.set_bridge_gaps_below_length(v); }));
  return set(
      "--height-step", arguments.height_step, [&](double v) { encode.set_height_step_ratio(v); },
      [&](double v) { encode.set_height_step_length(v); });
}

}  // namespace rilievo
