#include "client/cli/report_output.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/strip.h"
#include "client/cli/length_words.h"
#include "client/cli/scan_error.h"
#include "server/command_line/text_layout.h"
#include "server/conversion/convert_place.h"

namespace rilievo {
namespace {

using Json = nlohmann::ordered_json;

std::string DroppedText(const v1::ReconstructReport& report) {
  const std::pair<int64_t, const char*> kinds[] = {{report.non_finite(), "non-finite"},
                                                   {report.duplicates(), "duplicate"},
                                                   {report.strays(), "stray"},
                                                   {report.outliers(), "outlying"},
                                                   {report.island_points(), "on islands"},
                                                   {report.foliage_points(), "in foliage"}};
  std::vector<std::string> parts;
  for (const auto& [count, name] : kinds) {
    if (count > 0) parts.push_back(absl::StrCat(Grouped(count), " ", name));
  }
  return parts.empty() ? "none dropped" : "dropped " + absl::StrJoin(parts, ", ");
}

// What went in.
std::string InputText(const v1::ReconstructReport& report, const ReportPaths& paths) {
  if (!report.has_mesh()) {
    return absl::StrCat(paths.scan, ": ", Counted(report.points_in(), "point", "points"), " (",
                        paths.scan_format, "), ", DroppedText(report));
  }
  const v1::MeshReport& mesh = report.mesh();
  std::string text =
      absl::StrCat(paths.scan, ": ", Counted(mesh.triangles(), "triangle", "triangles"), ", ",
                   Counted(report.points_in(), "vertex", "vertices"), " (", paths.scan_format, ")");
  const std::pair<int64_t, const char*> kinds[] = {{mesh.welded_vertices(), " vertices welded"},
                                                   {mesh.dropped(), " triangles dropped"},
                                                   {mesh.flipped(), " triangles turned over"},
                                                   {mesh.opened_edges(), " edges opened"}};
  for (const auto& [count, what] : kinds) {
    if (count > 0) absl::StrAppend(&text, ", ", Grouped(count), what);
  }
  return text;
}

Json MeshJson(const v1::MeshReport& mesh) {
  return {{"triangles", mesh.triangles()},       {"welded_vertices", mesh.welded_vertices()},
          {"dropped", mesh.dropped()},           {"flipped", mesh.flipped()},
          {"opened_edges", mesh.opened_edges()}, {"triangles_used", mesh.triangles_used()}};
}

std::string TimesText(const v1::ReconstructReport& report) {
  std::vector<std::string> parts;
  for (const v1::StageTime& time : report.stage_times()) {
    parts.push_back(absl::StrFormat("%s %.2f", StageLabel(time.stage()), time.seconds()));
  }
  return absl::StrFormat("%.2f s (%s)", report.total_seconds(), absl::StrJoin(parts, ", "));
}

ScanError ScanErrorOf(const v1::ReconstructReport& report) {
  const v1::DistanceSummary& points = report.error().points_to_surface();
  std::vector<FieldViolation> none;
  const double d = report.diagonal();
  return {points.rms() * d, points.p95() * d, points.max() * d, d,
          ReadPlace(report.place(), &none)};
}

std::string ErrorText(const v1::ReconstructReport& report) {
  const ScanError error = ScanErrorOf(report);
  const auto both = [&](double ratio) {
    return absl::StrCat(LengthText(ratio * error.diagonal, error.place), " (", Percent(ratio), ")");
  };
  // The way back ends at a point, so it is never below about half the spacing of the points.
  const char* const input = InputName(report.road());
  const std::string apart =
      report.mesh().triangles() > 0
          ? ""
          : absl::StrCat(", the points being ", both(report.median_spacing_ratio()), " apart");
  return absl::StrCat(input, " to surface: ", ScanErrorText(error), "; surface to ", input,
                      ": RMS ", both(report.error().surface_to_points().rms()), ", max ",
                      both(report.error().surface_to_points().max()), apart,
                      "; across the surface, the larger of both ways: RMS ",
                      both(report.error().rms_across()), "; % of the diagonal, ",
                      LengthText(error.diagonal, error.place));
}

// Short: the length where its unit is known, the fraction always.
std::string LineOf(const ScanError& error) {
  const std::string share = Percent(error.rms / error.diagonal);
  if (!(error.place.metres_per_unit > 0)) return absl::StrCat("RMS ", share);
  return absl::StrCat("RMS ", LengthText(error.rms, error.place), " (", share, ")");
}

std::string SizeText(const v1::ReconstructReport& report, const SurfaceTarget& target) {
  const std::string bytes = Counted(report.encoded_bytes(), "byte", "bytes");
  if (!target.is_mesh()) return bytes;
  return absl::StrCat(bytes, " as a .dss file, ",
                      target.kept_dss.empty() ? "which --keep-dss keeps"
                                              : absl::StrCat("kept as ", target.kept_dss));
}

// What the surface has its side from, or does not.
std::string SidesText(const v1::ReconstructReport& report) {
  const auto text = [](const v1::SightReport& sights, const char* what) {
    return absl::StrCat(what, " of ", Counted(sights.points(), "point", "points"),
                        sights.used() ? "" : ", not believed");
  };
  std::vector<std::string> parts;
  if (report.has_stations()) parts.push_back(text(report.stations(), "stations"));
  if (report.has_normals()) parts.push_back(text(report.normals(), "given normals"));
  return absl::StrJoin(parts, "; ");
}

Json SightJson(const v1::SightReport& sights) {
  return {{"points", sights.points()},
          {"usable", sights.usable()},
          {"alignment", sights.alignment()},
          {"consistency", sights.consistency()},
          {"used", sights.used()}};
}

Json SummaryJson(const v1::DistanceSummary& summary) {
  return {{"rms", summary.rms()},
          {"mean", summary.mean()},
          {"p95", summary.p95()},
          {"max", summary.max()},
          {"samples", summary.samples()}};
}

Json ErrorJson(const v1::ReconstructReport& report) {
  const v1::TwoSidedError& error = report.error();
  return {{"scan_to_surface", ScanErrorJson(ScanErrorOf(report))},
          {"rms", error.rms()},
          {"mean", error.mean()},
          {"p95", error.p95()},
          {"max", error.max()},
          {"rms_across", error.rms_across()},
          {"surface_to_points", SummaryJson(error.surface_to_points())},
          {"points_to_surface", SummaryJson(error.points_to_surface())}};
}

}  // namespace

std::string StageLabel(v1::Stage stage) {
  const std::string name(absl::StripPrefix(v1::Stage_Name(stage), "STAGE_"));
  return absl::StrReplaceAll(absl::AsciiStrToLower(name), {{"_", "-"}});
}

std::string ReportText(const v1::ReconstructReport& report, const ReportPaths& paths) {
  std::string text = absl::StrCat(paths.target.path, "\n");
  const auto add = [&](const char* label, const std::string& line) {
    text += LabelledLine(label, line);
  };
  add(report.has_mesh() ? "mesh" : "scan", InputText(report, paths));
  if (paths.alignment) add("aligned", AlignedLine(*paths.alignment));
  if (report.has_stations() || report.has_normals()) add("sides", SidesText(report));
  add("topology", absl::StrCat(report.road(), ": ", report.road_reason()));
  add("surface",
      absl::StrCat(
          Counted(report.components(), "component", "components"), ", genus ", report.genus(), ", ",
          report.boundary_loops() == 0
              ? std::string("closed")
              : Counted(report.boundary_loops(), "boundary loop", "boundary loops"),
          "; ", Counted(report.control_faces(), "control face", "control faces"), ", at level ",
          report.max_level(), " ", Counted(report.surface_faces(), "face", "faces")));
  const double heights =
      std::max(1.0, static_cast<double>(report.heights_measured() + report.heights_smoothed() +
                                        report.heights_filled()));
  add("heights",
      absl::StrCat(Percent(static_cast<double>(report.heights_measured()) / heights), " measured, ",
                   Percent(static_cast<double>(report.heights_smoothed()) / heights), " smoothed, ",
                   Percent(static_cast<double>(report.heights_filled()) / heights), " filled in"));
  if (report.has_error()) add("error", ErrorText(report));
  if (report.has_colors()) {
    add("colours",
        absl::StrCat(Counted(report.colors().bytes(), "byte", "bytes"), " of the size, RMS ",
                     Percent(report.colors().rms()), " lost by coding"));
  }
  add("size", SizeText(report, paths.target));
  add("time", TimesText(report));
  for (const std::string& warning : report.warnings()) add("warning", warning);
  return text;
}

std::string ReportLine(const v1::ReconstructReport& report, const ReportPaths& paths) {
  return Wrap(
      absl::StrCat(paths.target.path, ": ",
                   report.has_mesh() ? Counted(report.mesh().triangles(), "triangle", "triangles")
                                     : Counted(report.points_used(), "point", "points"),
                   ", ", report.road(), ", genus ", report.genus(), ", ",
                   report.boundary_loops() == 0 ? std::string("closed")
                                                : Counted(report.boundary_loops(), "loop", "loops"),
                   report.has_error() ? absl::StrCat(", ", InputName(report.road()), " to surface ",
                                                     LineOf(ScanErrorOf(report)))
                                      : "",
                   ", ", Grouped(report.encoded_bytes()), " bytes, ",
                   absl::StrFormat("%.2f s", report.total_seconds()),
                   report.warnings().empty()
                       ? ""
                       : "; " + Counted(report.warnings_size(), "warning", "warnings")),
      2);
}

std::string FailureJson(const absl::Status& status, const ReportPaths& paths) {
  const Json json = {{"scan", paths.scan},
                     {"output", paths.target.path},
                     {"error",
                      {{"code", absl::StatusCodeToString(status.code())},
                       {"message", std::string(status.message())}}}};
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string ReportJson(const v1::ReconstructReport& report, const ReportPaths& paths) {
  Json json;
  json["scan"] = paths.scan;
  if (!paths.merged.empty()) json["merged"] = paths.merged;
  if (paths.alignment) json["alignment"] = AlignmentJson(*paths.alignment);
  json["scan_format"] = paths.scan_format;
  json["output"] = paths.target.path;
  if (!paths.target.kept_dss.empty()) json["kept_dss"] = paths.target.kept_dss;
  json["version"] = RILIEVO_VERSION;
  json["points_in"] = report.points_in();
  json["non_finite"] = report.non_finite();
  json["duplicates"] = report.duplicates();
  json["strays"] = report.strays();
  json["outliers"] = report.outliers();
  json["island_points"] = report.island_points();
  json["foliage_points"] = report.foliage_points();
  json["points_used"] = report.points_used();
  json["mesh"] = report.has_mesh() ? MeshJson(report.mesh()) : Json();
  json["diagonal"] = report.diagonal();
  json["median_spacing_ratio"] = report.median_spacing_ratio();
  json["median_noise_ratio"] = report.median_noise_ratio();
  json["normal_disagreement"] = report.normal_disagreement();
  json["stations"] = report.has_stations() ? SightJson(report.stations()) : Json();
  json["normals"] = report.has_normals() ? SightJson(report.normals()) : Json();
  json["road"] = report.road();
  json["road_reason"] = report.road_reason();
  json["components"] = report.components();
  json["boundary_loops"] = report.boundary_loops();
  json["genus"] = report.genus();
  json["control_vertices"] = report.control_vertices();
  json["control_faces"] = report.control_faces();
  json["max_level"] = report.max_level();
  json["surface_vertices"] = report.surface_vertices();
  json["surface_faces"] = report.surface_faces();
  json["domain_rms_ratio"] = report.domain_rms_ratio();
  json["fit_rounds"] = report.fit_rounds();
  json["fit_converged"] = report.fit_converged();
  json["heights_measured"] = report.heights_measured();
  json["heights_smoothed"] = report.heights_smoothed();
  json["heights_filled"] = report.heights_filled();
  json["error"] = report.has_error() ? ErrorJson(report) : Json();
  json["colors"] = report.has_colors()
                       ? Json{{"bytes", report.colors().bytes()}, {"rms", report.colors().rms()}}
                       : Json();
  json["max_error_kept"] = report.has_max_error_kept() ? Json(report.max_error_kept()) : Json();
  json["encoded_bytes"] = report.encoded_bytes();
  json["stage_seconds"] = Json::object();
  for (const v1::StageTime& time : report.stage_times()) {
    json["stage_seconds"][StageLabel(time.stage())] = time.seconds();
  }
  json["total_seconds"] = report.total_seconds();
  json["warnings"] = Json::array();
  for (const std::string& warning : report.warnings()) json["warnings"].push_back(warning);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace rilievo
