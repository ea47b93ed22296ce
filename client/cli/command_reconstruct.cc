#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/progress_display.h"
#include "client/cli/reconstruct_options.h"
#include "client/cli/report_output.h"
#include "client/cli/scan_set.h"
#include "client/cli/server_words.h"
#include "client/cli/surface_output.h"
#include "client/cli/working_server.h"
#include "client/formats/scan_writer.h"
#include "client/library/reconstruction_client.h"
#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

// From here on memory counts for more than the twentieth of the time that its return takes.
constexpr int64_t kManyPoints = 300'000;

struct Arguments {
  std::vector<std::string> scans;
  std::string report;
  SurfaceOutputArguments surface;
  ScanArguments scan;
  ServerArguments connection;
  ReconstructArguments options;
  std::string kept_scan;  // file for the merged scan; empty: none
  bool merge = false, align = false, quiet = false, json = false;
};

ReconstructCallbacks ShowProgress(int64_t points, bool remote, ProgressDisplay* display) {
  ReconstructCallbacks callbacks;
  if (remote) {
    callbacks.sent = [=](int64_t sent) {
      display->Update(0, v1::Stage_MAX - v1::STAGE_CHECK + 1, "sending",
                      static_cast<double>(sent) / static_cast<double>(points));
    };
  }
  callbacks.progress = [=](const v1::Progress& progress) {
    if (progress.stage() < v1::STAGE_CHECK) return;
    display->Update(progress.stage() - v1::STAGE_CHECK + 1, v1::Stage_MAX - v1::STAGE_CHECK + 1,
                    StageLabel(progress.stage()), progress.fraction());
  };
  return callbacks;
}

absl::Status Explain(const absl::Status& status, const std::string& scan,
                     const std::string& server) {
  std::string message = WordsOf(status);
  if (status.code() == absl::StatusCode::kUnavailable && !server.empty()) {
    message = absl::StrCat("the server at ", server, " is unavailable: ", message,
                           "\nIs rilievod running there? Without --server the work is done here.");
  } else if (status.code() == absl::StatusCode::kCancelled) {
    message = "cancelled; nothing was written";
  } else if (status.code() != absl::StatusCode::kResourceExhausted) {
    message = absl::StrCat(scan, ": ", message);
  }
  return absl::Status(status.code(), message);
}

struct Made {
  v1::ReconstructReport report;
  ReportPaths paths;
};

// A scan as it was read, and the words for where it comes from.
struct Source {
  ScanFile scan;
  ReportPaths paths;  // no target yet
};

absl::StatusOr<Source> ReadOne(const Arguments& arguments, const std::string& path) {
  RILIEVO_ASSIGN_OR_RETURN(ScanFile scan,
                           LoadScan(path, arguments.scan, LayersFor(arguments.options)));
  ReportPaths paths{path, scan.format, {}};
  return Source{std::move(scan), std::move(paths)};
}

absl::StatusOr<Source> ReadMerged(const Arguments& arguments, const std::stop_token& stop) {
  WantedLayers wanted = LayersFor(arguments.options);
  wanted.intensity = !arguments.kept_scan.empty();
  RILIEVO_ASSIGN_OR_RETURN(
      ScanSet set, LoadScans(arguments.scans, arguments.scan, arguments.options.place, wanted));
  ReportPaths paths{NameOfAll(arguments.scans), "", {}, arguments.scans};
  if (arguments.align) {
    RunContext context;
    context.stop = stop;
    context.threads = static_cast<int>(arguments.options.threads.value_or(0));
    RILIEVO_ASSIGN_OR_RETURN(Alignment alignment, AlignSet(context, &set));
    paths.alignment = AlignmentReport{arguments.scans, std::move(alignment), set.place};
    RILIEVO_RETURN_IF_ERROR(CheckAlignment(*paths.alignment));
  }
  RILIEVO_ASSIGN_OR_RETURN(ScanFile scan, MergeSet(std::move(set)));
  paths.scan_format = scan.format;
  if (!arguments.kept_scan.empty()) {
    RILIEVO_RETURN_IF_ERROR(WithExitCode(WritePlyScan(arguments.kept_scan, scan.cloud, scan.layers),
                                         ExitCode::kOutput));
  }
  return Source{std::move(scan), std::move(paths)};
}

// From the points of a scan to the file of its surface.
absl::StatusOr<Made> MakeSurface(const Arguments& arguments, absl::StatusOr<Source> read,
                                 const SurfaceTarget& target, v1::ReconstructOptions options,
                                 const ReconstructionClient& client, const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(Source source, std::move(read));
  ScanFile scan = std::move(source.scan);
  source.paths.target = target;
  RILIEVO_RETURN_IF_ERROR(SetPlace(arguments.options, source.paths.scan, scan.place, &options));
  const bool works_here = arguments.connection.server.empty();
  if (works_here && scan.cloud.points.cols() >= kManyPoints) ReleaseLargeBlocksAtOnce();
  ProgressDisplay display(
      arguments.quiet ? ProgressDisplay::Style::kNone : ProgressDisplay::StyleOfStandardError(),
      std::cerr);
  CallOptions call;
  call.stop = stop;
  const ReconstructCallbacks callbacks =
      ShowProgress(scan.cloud.points.cols(), !works_here, &display);
  absl::StatusOr<ReconstructResult> result =
      client.Reconstruct(std::move(scan.cloud), options, callbacks, call);
  if (!result.ok()) {
    return Explain(result.status(), source.paths.scan, arguments.connection.server);
  }
  display.Finish();
  RunContext context;
  context.stop = stop;
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, result->dss, context));
  return Made{std::move(result->report), std::move(source.paths)};
}

absl::Status MakeOne(const Arguments& arguments, const SurfaceTarget& target,
                     const v1::ReconstructOptions& options, const ReconstructionClient& client,
                     const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const Made made,
                           MakeSurface(arguments,
                                       arguments.merge ? ReadMerged(arguments, stop)
                                                       : ReadOne(arguments, arguments.scans[0]),
                                       target, options, client, stop));
  const std::string json = ReportJson(made.report, made.paths);
  if (!arguments.report.empty()) RILIEVO_RETURN_IF_ERROR(WriteText(arguments.report, json));
  if (arguments.json) {
    std::cout << json;
  } else {
    WordsBeside(IsStandardOutput(arguments.report) ? arguments.report : target.path)
        << ReportText(made.report, made.paths);
  }
  return absl::OkStatus();
}

// Goes on after a scan that fails; ends with the exit code of the first that did.
absl::Status MakeMany(const Arguments& arguments, const std::vector<SurfaceTarget>& targets,
                      const v1::ReconstructOptions& options, const ReconstructionClient& client,
                      const std::stop_token& stop) {
  std::vector<std::string> reports;
  absl::Status first;
  int failed = 0;
  for (size_t i = 0; i < targets.size(); ++i) {
    const std::string& scan = arguments.scans[i];
    const absl::StatusOr<Made> made =
        MakeSurface(arguments, ReadOne(arguments, scan), targets[i], options, client, stop);
    if (stop.stop_requested()) {
      return absl::CancelledError(
          absl::StrCat("cancelled after ", i, " of ", targets.size(), " scans"));
    }
    if (made.ok()) {
      reports.push_back(ReportJson(made->report, made->paths));
      if (arguments.json || IsStandardOutput(arguments.report)) continue;
      std::cout << ReportLine(made->report, made->paths) << std::endl;
      continue;
    }
    ++failed;
    reports.push_back(FailureJson(made.status(), {scan, "", targets[i]}));
    std::cerr << Wrap(absl::StrCat(scan, ": failed: ", std::string(made.status().message())), 2)
              << std::endl;
    if (first.ok()) first = made.status();
  }
  const std::string json = absl::StrCat("[\n", absl::StrJoin(reports, ",\n"), "]\n");
  if (!arguments.report.empty()) RILIEVO_RETURN_IF_ERROR(WriteText(arguments.report, json));
  if (arguments.json) std::cout << json;
  if (failed == 0) return absl::OkStatus();
  return WithExitCode(
      absl::Status(first.code(), absl::StrCat(failed, " of ", targets.size(), " scans failed")),
      ExitCodeOf(first));
}

// The scans that get a surface of their own: all, or the first in the name of all.
std::vector<std::string> SurfaceNames(const Arguments& arguments) {
  return arguments.merge ? std::vector<std::string>{arguments.scans[0]} : arguments.scans;
}

absl::Status CheckMerge(const Arguments& arguments) {
  if (arguments.align && arguments.scans.size() < 2) {
    return UsageError(
        absl::StrCat("--align: ", arguments.scans[0], " is one scan alone; give at least two"));
  }
  if (arguments.kept_scan.empty()) return absl::OkStatus();
  return CheckExtension(arguments.kept_scan, "ply", "the merged scan is a PLY file");
}

absl::Status Run(const Arguments& arguments, std::stop_token stop) {
  RILIEVO_RETURN_IF_ERROR(CheckMerge(arguments));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<SurfaceTarget> targets,
                           SurfaceTargets(SurfaceNames(arguments), arguments.surface));
  CommandFiles files{
      arguments.scans, PathsOf(targets), {arguments.report, arguments.json ? "-" : ""}};
  files.outputs.push_back(arguments.kept_scan);
  AppendFilesOf(arguments.options, &files.inputs);
  AppendFilesOf(arguments.connection, &files.inputs);
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RILIEVO_ASSIGN_OR_RETURN(const v1::ReconstructOptions options, OptionsFrom(arguments.options));
  RILIEVO_ASSIGN_OR_RETURN(const WorkingServer server, ConnectOrStart(arguments.connection));
  const ReconstructionClient client(server.channel);
  return targets.size() == 1 ? MakeOne(arguments, targets[0], options, client, stop)
                             : MakeMany(arguments, targets, options, client, stop);
}

}  // namespace

Command AddReconstruct(CLI::App& program) {
  CLI::App* app = program.add_subcommand("reconstruct", "Make a surface or a mesh from a scan");
  const auto a = std::make_shared<Arguments>();
  app->add_option(
         "SCAN", a->scans,
         "the points: PLY, PCD, XYZ, PTS, TXT, OBJ, LAS, LAZ, E57, PTX; - is standard input; "
         "several become several surfaces, or one with --merge")
      ->required();
  AddSurfaceOutput(app, "a folder (DIR/) for several scans; ", &a->surface)->required();
  app->add_option(
      "--server", a->connection.server,
      "HOST:PORT of a rilievod, or several with commas between: the first that answers; "
      "without it the work is done in this process");
  AddServerOptions(app, &a->connection);
  AddFormatOption(app, &a->scan.format);
  AddScanOptions(app, &a->scan);
  AddReconstructOptions(app, &a->options);
  CLI::Option* merge = app->add_flag(
      "--merge", a->merge,
      "one surface of all scans, which must share unit, way up and coordinate reference system");
  app->add_flag("--align", a->align,
                "with --merge: bring the scans together first, as 'rilievo align' does")
      ->needs(merge);
  app->add_option("--keep-scan", a->kept_scan,
                  "with --merge: write the merged scan to this .ply file, for verify and compare")
      ->needs(merge);
  app->add_option("--report", a->report, "write the report as JSON to this file");
  app->add_flag("--json", a->json, "print the report as JSON; several scans: a list");
  app->add_flag("--quiet", a->quiet, "show no progress");
  return {app, [a](std::stop_token stop) { return Run(*a, stop); }};
}

}  // namespace rilievo
