#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
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
#include "client/cli/loaded_shape.h"
#include "client/cli/measure_words.h"
#include "client/cli/output_target.h"
#include "client/cli/vector_json.h"
#include "client/formats/file_kind.h"
#include "client/formats/section_writer.h"
#include "core/base/status_macros.h"
#include "core/surface/closest_point_tree.h"
#include "core/surface/mass_properties.h"
#include "core/surface/plane_section.h"
#include "core/surface/signed_distance.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Json = nlohmann::ordered_json;
using RayHit = ClosestPointTree::RayHit;

struct MeasureArguments {
  std::string input, sections, points;
  std::optional<int> level;
  std::vector<std::string> planes, rays;
  ScanArguments scan;
  bool json = false;
};

struct DistanceFigures {
  int64_t points = 0, outside = 0;  // those that are finite
  double mean = 0, rms = 0, least = 0, greatest = 0;
};

struct Measured {
  MassProperties mass;
  std::vector<PlaneSection> sections;
  std::vector<std::vector<RayHit>> hits;  // of each ray
  std::optional<DistanceFigures> distances;
};

std::string Number(double value) { return absl::StrFormat("%.9g", value); }
std::string NineDigits(const Vector3d& vector) {
  return absl::StrFormat("%.9g %.9g %.9g", vector.x(), vector.y(), vector.z());
}

absl::StatusOr<DistanceFigures> FiguresOf(const TriangleMesh& mesh,
                                          const MeasureArguments& arguments,
                                          const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile scan, LoadScan(arguments.points, arguments.scan));
  RILIEVO_ASSIGN_OR_RETURN(const SignedDistance field, SignedDistance::Build(mesh, 1, context));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<double> distances,
                           field.Of(scan.cloud.points, context));
  DistanceFigures figures;
  for (const double distance : distances) {
    if (std::isnan(distance)) continue;  // of a point that is not finite
    if (figures.points++ == 0) figures.least = figures.greatest = distance;
    figures.outside += distance > 0;
    figures.mean += distance;
    figures.rms += distance * distance;
    figures.least = std::min(figures.least, distance);
    figures.greatest = std::max(figures.greatest, distance);
  }
  if (figures.points == 0) {
    return absl::InvalidArgumentError(absl::StrCat(arguments.points, ": has no finite point"));
  }
  figures.mean /= static_cast<double>(figures.points);
  figures.rms = std::sqrt(figures.rms / static_cast<double>(figures.points));
  return figures;
}

absl::StatusOr<Measured> MeasureShape(const TriangleMesh& mesh, const std::vector<Plane>& planes,
                                      const std::vector<ProbeRay>& rays,
                                      const MeasureArguments& arguments,
                                      const RunContext& context) {
  Measured measured;
  const auto mass = MassPropertiesOf(mesh.vertices, mesh.triangles);
  if (!mass.ok()) return AtPath(arguments.input, mass.status());
  measured.mass = *mass;
  for (const Plane& plane : planes) {
    RILIEVO_ASSIGN_OR_RETURN(PlaneSection section, CutByPlane(mesh, plane.normal, plane.offset));
    measured.sections.push_back(std::move(section));
  }
  if (!rays.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                             ClosestPointTree::Over(mesh.vertices, mesh.triangles, context));
    for (const ProbeRay& ray : rays) {
      measured.hits.push_back(tree.AlongRay(ray.from, ray.direction));
    }
  }
  if (!arguments.points.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(measured.distances, FiguresOf(mesh, arguments, context));
  }
  return measured;
}

Json MassJson(const MassProperties& mass) {
  Json json;
  json["closed"] = mass.closed;
  json["area"] = mass.area;
  json["volume"] = mass.closed ? Json(mass.volume) : Json();
  json["centroid"] = VectorJson(mass.centroid);
  json["inertia"] = {VectorJson(mass.inertia.col(0)), VectorJson(mass.inertia.col(1)),
                     VectorJson(mass.inertia.col(2))};
  return json;
}

Json SectionJson(const PlaneSection& section) {
  Json json = {{"normal", VectorJson(section.plane.normal)},
               {"offset", section.plane.offset},
               {"length", section.length},
               {"area", section.area},
               {"polylines", Json::array()}};
  for (const SectionPolyline& polyline : section.polylines) {
    json["polylines"].push_back({{"closed", polyline.closed}, {"points", polyline.points.cols()}});
  }
  return json;
}

Json RayJson(const ProbeRay& ray, const std::vector<RayHit>& hits) {
  Json json = {{"from", VectorJson(ray.from)},
               {"direction", VectorJson(ray.direction)},
               {"hits", Json::array()}};
  for (const RayHit& hit : hits) {
    json["hits"].push_back({{"position", VectorJson(ray.from + hit.at * ray.direction)},
                            {"distance", hit.at * ray.direction.norm()},
                            {"leaves", hit.from_behind}});
  }
  return json;
}

Json MeasuredJson(const MeasureArguments& arguments, const std::vector<ProbeRay>& rays,
                  const Measured& measured) {
  Json json = MassJson(measured.mass);
  json["sections"] = Json::array();
  for (const PlaneSection& section : measured.sections) {
    json["sections"].push_back(SectionJson(section));
  }
  json["rays"] = Json::array();
  for (size_t i = 0; i < rays.size(); ++i) {
    json["rays"].push_back(RayJson(rays[i], measured.hits[i]));
  }
  if (const auto& distances = measured.distances) {
    json["points"] = {{"scan", arguments.points},       {"points", distances->points},
                      {"outside", distances->outside},  {"mean", distances->mean},
                      {"rms", distances->rms},          {"least", distances->least},
                      {"greatest", distances->greatest}};
  }
  return json;
}

void PrintMass(const MassProperties& mass) {
  const Eigen::Matrix3d& inertia = mass.inertia;
  std::cout << LabelledLine("area", Number(mass.area));
  if (mass.closed) std::cout << LabelledLine("volume", Number(mass.volume));
  std::cout << LabelledLine("centroid", NineDigits(mass.centroid))
            << LabelledLine(
                   "inertia",
                   absl::StrCat("xx ", Number(inertia(0, 0)), ", yy ", Number(inertia(1, 1)),
                                ", zz ", Number(inertia(2, 2)), ", xy ", Number(inertia(0, 1)),
                                ", xz ", Number(inertia(0, 2)), ", yz ", Number(inertia(1, 2)),
                                "; about the centroid, density 1 per ",
                                mass.closed ? "volume" : "area"));
  if (!mass.closed) {
    std::cout << LabelledLine("note",
                              "the shape is open: it has no volume, and centroid and inertia are "
                              "those of a shell");
  }
}

void PrintMeasured(const std::vector<ProbeRay>& rays, const Measured& measured) {
  PrintMass(measured.mass);
  for (const PlaneSection& section : measured.sections) {
    const auto count = static_cast<int64_t>(section.polylines.size());
    std::cout << LabelledLine(
        "section",
        absl::StrCat("normal ", NineDigits(section.plane.normal), ", offset ",
                     Number(section.plane.offset), ": ", Counted(count, "polyline", "polylines"),
                     ", length ", Number(section.length), ", area ", Number(section.area)));
  }
  for (size_t i = 0; i < rays.size(); ++i) {
    const std::vector<RayHit>& hits = measured.hits[i];
    std::cout << LabelledLine(
        "ray",
        absl::StrCat("from ", NineDigits(rays[i].from), " along ", NineDigits(rays[i].direction),
                     ": ", Counted(static_cast<int64_t>(hits.size()), "hit", "hits")));
    for (const RayHit& hit : hits) {
      std::cout << LabelledLine(
          "", absl::StrCat(hit.from_behind ? "leaves" : "enters", " at ",
                           NineDigits(rays[i].from + hit.at * rays[i].direction)));
    }
  }
  if (const auto& distances = measured.distances) {
    std::cout << LabelledLine(
        "points", absl::StrCat(Counted(distances->points, "point", "points"), ", ",
                               Grouped(distances->outside),
                               " outside; signed distance, positive outside: mean ",
                               Number(distances->mean), ", RMS ", Number(distances->rms), ", from ",
                               Number(distances->least), " to ", Number(distances->greatest)));
  }
}

absl::Status CheckSections(const MeasureArguments& arguments) {
  if (arguments.sections.empty()) return absl::OkStatus();
  const std::string extension = Extension(arguments.sections);
  if (!std::set<std::string>{"obj", "dxf", "svg"}.contains(extension)) {
    return UsageError(
        absl::StrCat(arguments.sections, ": the extension must be .obj, .dxf or .svg"));
  }
  if (extension == "svg" && arguments.planes.size() > 1) {
    return UsageError(absl::StrCat(arguments.sections,
                                   ": an .svg holds one section; give one --plane, or write .obj "
                                   "or .dxf"));
  }
  return absl::OkStatus();
}

absl::Status Measure(const MeasureArguments& arguments, std::stop_token stop) {
  RILIEVO_RETURN_IF_ERROR(CheckSections(arguments));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<Plane> planes, ReadPlaneWords(arguments.planes));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<ProbeRay> rays, ReadRayWords(arguments.rays));
  RILIEVO_RETURN_IF_ERROR(
      CheckFiles({{arguments.input, arguments.points}, {arguments.sections}, {"-"}}));
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(const LoadedShape shape, LoadShape(arguments.input, arguments.level,
                                                              context, arguments.scan.format));
  RILIEVO_ASSIGN_OR_RETURN(const Measured measured,
                           MeasureShape(shape.mesh, planes, rays, arguments, context));
  if (!arguments.sections.empty()) {
    RILIEVO_RETURN_IF_ERROR(
        WithExitCode(WriteSections(arguments.sections, measured.sections), ExitCode::kOutput));
  }
  if (arguments.json) {
    std::cout << MeasuredJson(arguments, rays, measured).dump(2) << '\n';
    return absl::OkStatus();
  }
  std::cout << arguments.input << " (" << shape.description << ")\n";
  PrintMeasured(rays, measured);
  return absl::OkStatus();
}

}  // namespace

Command AddMeasure(CLI::App& program) {
  CLI::App* app = program.add_subcommand(
      "measure", "Tell area, volume, centroid and inertia of a surface, and cut it by planes");
  const auto arguments = std::make_shared<MeasureArguments>();
  app->add_option("IN", arguments->input, "a surface (.dss) or a mesh; - is standard input")
      ->required();
  AddFormatOption(app, &arguments->scan.format);
  app->add_option("--level", arguments->level, "level of detail of a surface; default the finest")
      ->check(CLI::Range(0, 10));
  CLI::Option* plane =
      app->add_option("--plane", arguments->planes,
                      "cut by this plane: z=D (or x=D, y=D), or A,B,C,D for the places where "
                      "A x + B y + C z = D; several may follow")
          ->type_name("PLANE");
  app->add_option("--sections", arguments->sections,
                  "write the sections as polylines: .obj, .dxf, or, of one plane, .svg")
      ->needs(plane);
  app->add_option("--ray", arguments->rays,
                  "where a ray from X,Y,Z in the direction DX,DY,DZ meets the surface; several may "
                  "follow")
      ->type_name("X,Y,Z,DX,DY,DZ");
  app->add_option("--points", arguments->points,
                  "a scan: signed distances of its points from the surface, positive outside");
  AddScanOptions(app, &arguments->scan);
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Measure(*arguments, stop); }};
}

}  // namespace rilievo
