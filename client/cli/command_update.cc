#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/place_options.h"
#include "client/cli/scan_error.h"
#include "client/cli/scan_set.h"
#include "client/cli/server_connection.h"
#include "client/cli/surface_call.h"
#include "client/cli/surface_output.h"
#include "client/cli/working_server.h"
#include "client/library/reconstruction_client.h"
#include "core/base/status_macros.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

struct UpdateArguments {
  std::string input, scan;
  ScanArguments reading;
  PlaceArguments place;
  SurfaceOutputArguments output;
  ServerArguments connection;
  bool whole = false, json = false, quiet = false;
};

ScanError ErrorOf(const v1::DistanceSummary& distance, const DecodedSurface& own) {
  const double diagonal = own.surface.frame.diagonal;
  return {distance.rms() * diagonal, distance.p95() * diagonal, distance.max() * diagonal, diagonal,
          own.metadata.place};
}

void Print(const UpdateArguments& arguments, const ReconstructResult& result,
           const DecodedSurface& own) {
  const v1::UpdateReport& report = result.report.update();
  const ScanError before = ErrorOf(report.points_to_surface_before(), own);
  const ScanError after = ErrorOf(report.points_to_surface(), own);
  const auto bytes = static_cast<int64_t>(result.dss.size());
  if (arguments.json) {
    std::cout << nlohmann::ordered_json(
                     {{"output", arguments.output.output},
                      {"points", report.points()},
                      {"points_contradicting", report.points_contradicting()},
                      {"noise", report.noise_ratio() * own.surface.frame.diagonal},
                      {"scan_to_surface_before", ScanErrorJson(before)},
                      {"scan_to_surface", ScanErrorJson(after)},
                      {"heights", report.heights()},
                      {"heights_anew", report.heights_anew()},
                      {"heights_filled", report.heights_filled()},
                      {"groups", report.groups()},
                      {"groups_changed", report.groups_changed()},
                      {"bytes", bytes},
                      {"update_bytes", report.update_bytes()}})
                     .dump(2)
              << '\n';
    return;
  }
  std::ostream& out = WordsBeside(arguments.output.output);
  out << arguments.output.output << '\n'
      << LabelledLine("error", absl::StrCat("scan to surface: ", ScanErrorText(after),
                                            "; % of the diagonal"))
      << LabelledLine("before", ScanErrorText(before))
      << LabelledLine("points", absl::StrCat(Grouped(report.points_contradicting()), " of ",
                                             Grouped(report.points()), " contradict the surface"))
      << LabelledLine("heights", absl::StrCat(Grouped(report.heights_anew()), " of ",
                                              Grouped(report.heights()), " made anew, ",
                                              Grouped(report.heights_filled()), " of them filled"));
  if (report.groups() > 0) {
    out << LabelledLine("groups", absl::StrCat(Grouped(report.groups_changed()), " of ",
                                               Grouped(report.groups()), " changed"));
  }
  out << LabelledLine("size", absl::StrCat(Counted(bytes, "byte", "bytes"), " as a .dss file, ",
                                           Grouped(report.update_bytes()), " of them new"));
}

absl::Status Update(const UpdateArguments& arguments, std::stop_token stop) {
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceTarget target, SurfaceTargetOf(arguments.output));
  CommandFiles files{.inputs = {arguments.input, arguments.scan}, .outputs = PathsOf({target})};
  if (arguments.json) files.text.push_back("-");
  AppendFilesOf(arguments.connection, &files.inputs);
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RunContext context;
  context.stop = stop;
  UpdatedSurface base;
  base.whole = arguments.whole;
  RILIEVO_ASSIGN_OR_RETURN(base.dss, ReadBytes(arguments.input));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface own,
                           DecodeBytes(arguments.input, base.dss, context));
  base.vertices = static_cast<int64_t>(own.surface.heights.size());
  RILIEVO_ASSIGN_OR_RETURN(ScanFile scan, LoadScan(arguments.scan, arguments.reading));
  RILIEVO_RETURN_IF_ERROR(
      CheckSamePlace(arguments.input, own.metadata.place, arguments.scan,
                     PlaceOf(arguments.place, Completed(scan.place, own.metadata.place))));
  RILIEVO_ASSIGN_OR_RETURN(const WorkingServer server, ConnectOrStart(arguments.connection));
  const std::string& remote = arguments.connection.server;
  ProgressDisplay display(
      arguments.quiet ? ProgressDisplay::Style::kNone : ProgressDisplay::StyleOfStandardError(),
      std::cerr);
  const PointCloud points{std::move(scan.cloud.points)};  // its sights are not used
  const absl::StatusOr<ReconstructResult> result =
      ReconstructionClient(server.channel)
          .Update(points, base,
                  ShowProgress(points.points.cols(), !remote.empty(), nullptr, &display),
                  {.timeout = {}, .stop = stop});
  if (!result.ok()) {
    return Explain(result.status(), absl::StrCat(arguments.input, " and ", arguments.scan), remote);
  }
  display.Finish();
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, result->dss, context));
  Print(arguments, *result, own);
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
  app->add_option("--server", arguments->connection.server,
                  "HOST:PORT of a rilievod, or several with commas between: the first that "
                  "answers; without it the work is done in this process");
  AddServerOptions(app, &arguments->connection);
  app->add_flag("--json", arguments->json, "print JSON");
  app->add_flag("--quiet", arguments->quiet, "show no progress");
  return {app, [arguments](std::stop_token stop) { return Update(*arguments, stop); }};
}

}  // namespace rilievo
