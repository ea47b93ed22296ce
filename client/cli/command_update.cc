#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/place_options.h"
#include "client/cli/scan_error.h"
#include "client/cli/scan_set.h"
#include "client/cli/surface_output.h"
#include "core/base/status_macros.h"
#include "core/pipeline/update_surface.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

struct UpdateArguments {
  std::string input, scan;
  ScanArguments reading;
  PlaceArguments place;
  SurfaceOutputArguments output;
  bool whole = false, json = false;
};

ScanError ErrorOf(const DistanceSummary& distance, const DecodedSurface& own) {
  const double diagonal = own.surface.frame.diagonal;
  return {distance.rms * diagonal, distance.p95 * diagonal, distance.max * diagonal, diagonal,
          own.metadata.place};
}

void Print(const UpdateArguments& arguments, const SurfaceUpdate& update,
           const DecodedSurface& own) {
  const UpdateReport& report = update.report;
  const auto bytes = static_cast<int64_t>(update.dss.size());
  if (arguments.json) {
    std::cout << nlohmann::ordered_json(
                     {{"output", arguments.output.output},
                      {"points", report.points},
                      {"points_contradicting", report.contradicting},
                      {"noise", report.noise * own.surface.frame.diagonal},
                      {"scan_to_surface_before", ScanErrorJson(ErrorOf(report.before, own))},
                      {"scan_to_surface", ScanErrorJson(ErrorOf(report.after, own))},
                      {"heights", report.heights},
                      {"heights_anew", report.heights_anew},
                      {"heights_filled", report.heights_filled},
                      {"groups", report.groups},
                      {"groups_changed", report.groups_changed},
                      {"folds_before", report.folds_before},
                      {"folds", report.folds},
                      {"bytes", bytes},
                      {"update_bytes", report.update_bytes}})
                     .dump(2)
              << '\n';
    return;
  }
  std::ostream& out = WordsBeside(arguments.output.output);
  out << arguments.output.output << '\n'
      << LabelledLine("error",
                      absl::StrCat("scan to surface: ", ScanErrorText(ErrorOf(report.after, own)),
                                   "; % of the diagonal"))
      << LabelledLine("before", ScanErrorText(ErrorOf(report.before, own)))
      << LabelledLine("points", absl::StrCat(Grouped(report.contradicting), " of ",
                                             Grouped(report.points), " contradict the surface"))
      << LabelledLine("heights", absl::StrCat(Grouped(report.heights_anew), " of ",
                                              Grouped(report.heights), " made anew, ",
                                              Grouped(report.heights_filled), " of them filled"));
  if (report.groups > 0) {
    out << LabelledLine("groups", absl::StrCat(Grouped(report.groups_changed), " of ",
                                               Grouped(report.groups), " changed"));
  }
  if (report.folds > report.folds_before) {
    out << LabelledLine("folds", absl::StrCat(Grouped(report.folds), " triangles, ",
                                              Grouped(report.folds_before), " before"));
  }
  out << LabelledLine("size", absl::StrCat(Counted(bytes, "byte", "bytes"), " as a .dss file, ",
                                           Grouped(report.update_bytes), " of them new"));
}

// What its file does not say is taken to be as that of the surface.
ScanPlace PlaceOfScan(ScanPlace place, const DecodedSurface& own) {
  const ScanPlace& known = own.metadata.place;
  if (place.metres_per_unit == 0) place.metres_per_unit = known.metres_per_unit;
  if (place.up == UpDirection::kUnknown) place.up = known.up;
  if (place.crs.empty()) place.crs = known.crs;
  return place;
}

absl::Status Update(const UpdateArguments& arguments, std::stop_token stop) {
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceTarget target, SurfaceTargetOf(arguments.output));
  CommandFiles files{.inputs = {arguments.input, arguments.scan}, .outputs = PathsOf({target})};
  if (arguments.json) files.text.push_back("-");
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> before, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface own, DecodeBytes(arguments.input, before, context));
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile scan, LoadScan(arguments.scan, arguments.reading));
  RILIEVO_RETURN_IF_ERROR(CheckSamePlace(arguments.input, own.metadata.place, arguments.scan,
                                         PlaceOf(arguments.place, PlaceOfScan(scan.place, own))));
  const absl::StatusOr<SurfaceUpdate> update =
      UpdateSurface(before, scan.cloud, {.whole = arguments.whole}, context);
  if (!update.ok()) {
    return absl::Status(
        update.status().code(),
        absl::StrCat(arguments.input, " and ", arguments.scan, ": ", update.status().message()));
  }
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, update->dss, context));
  Print(arguments, *update, own);
  return absl::OkStatus();
}

}  // namespace

Command AddUpdate(CLI::App& program) {
  CLI::App* app =
      program.add_subcommand("update", "Bring a surface up to date by a new scan of what changed");
  const auto arguments = std::make_shared<UpdateArguments>();
  app->add_option("IN", arguments->input, "the surface, a .dss file; - is standard input")
      ->required();
  app->add_option("SCAN", arguments->scan,
                  "a new scan of it, in the same frame and unit, of all or of the part that "
                  "changed")
      ->required();
  app->add_flag("--whole", arguments->whole,
                "the scan shows all there is to see: heights that were measured where it has no "
                "points become filled ones; default: they stay as they are");
  AddSurfaceOutput(app, "the file IN with what changed behind it, in bytes of its own; ",
                   &arguments->output)
      ->required();
  AddFormatOption(app, &arguments->reading.format);
  AddScanOptions(app, &arguments->reading);
  AddPlaceOptions(app, &arguments->place);
  app->add_flag("--json", arguments->json, "print JSON");
  return {app, [arguments](std::stop_token stop) { return Update(*arguments, stop); }};
}

}  // namespace rilievo
