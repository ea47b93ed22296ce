#include "client/cli/make_surfaces.h"

#include <CLI/CLI.hpp>
#include <iostream>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/exit_code.h"
#include "client/cli/output_target.h"
#include "client/cli/paged_scan_source.h"
#include "client/cli/progress_display.h"
#include "client/cli/surface_call.h"
#include "client/cli/time_left.h"
#include "client/cli/working_server.h"
#include "client/library/reconstruction_client.h"
#include "core/base/freed_memory.h"
#include "core/base/status_macros.h"
#include "core/pipeline/reconstruct.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

// From here on memory counts for more than the twentieth of the time that its return takes.
constexpr int64_t kManyPoints = 300'000;

// Explained, and how to go on where it ended; where that would end the same way nothing stays.
absl::Status WithWhereItStays(const absl::Status& status, const Source& source) {
  if (source.kept == nullptr || absl::IsPermissionDenied(status)) return status;
  if (IsLasting(status)) {
    source.kept->Remove();
    return status;
  }
  return WithMessage(
      status, absl::StrCat(status.message(), "\nWhat is finished stays in ",
                           source.kept->folder().path(), "; the same command goes on from there."));
}

struct Made {
  v1::ReconstructReport report;
  ReportPaths paths;
};

// From the points of a scan to the file of its surface.
absl::StatusOr<Made> MakeSurface(const MakingArguments& arguments, absl::StatusOr<Source> read,
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
  std::optional<TimeLeft> left;
  if (source.pages != nullptr) {
    left.emplace(source.pages->size(), source.pages->ThinnedCount(source.sizes.coarse_points));
  }
  const ReconstructCallbacks callbacks =
      ShowProgress(scan.cloud.points.cols(), !works_here, left ? &*left : nullptr, &display);
  absl::StatusOr<ReconstructResult> result =
      source.pages != nullptr
          ? ReconstructPages(*source.pages, source.sizes, options, callbacks.progress, stop)
          : client.Reconstruct(std::move(scan.cloud), options, callbacks, call);
  if (!result.ok()) {
    return WithWhereItStays(
        Explain(result.status(), source.paths.scan, arguments.connection.server), source);
  }
  display.Finish();
  RunContext context;
  context.stop = stop;
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, result->dss, context));
  if (source.kept != nullptr) source.kept->Remove();
  if (!source.warning.empty()) result->report.add_warnings(source.warning);
  return Made{std::move(result->report), std::move(source.paths)};
}

absl::Status MakeOne(const MakingArguments& arguments, const ReadSource& read,
                     const SurfaceTarget& target, const v1::ReconstructOptions& options,
                     const ReconstructionClient& client, const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const Made made, MakeSurface(arguments, read(arguments.inputs[0]),
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
absl::Status MakeMany(const MakingArguments& arguments, const ReadSource& read,
                      const std::vector<SurfaceTarget>& targets,
                      const v1::ReconstructOptions& options, const ReconstructionClient& client,
                      const std::stop_token& stop) {
  std::vector<std::string> reports;
  absl::Status first;
  int failed = 0;
  for (size_t i = 0; i < targets.size(); ++i) {
    const std::string& scan = arguments.inputs[i];
    const absl::StatusOr<Made> made =
        MakeSurface(arguments, read(scan), targets[i], options, client, stop);
    if (stop.stop_requested()) {
      return absl::CancelledError(absl::StrCat("cancelled after ", i, " of ", targets.size()));
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
      absl::Status(first.code(), absl::StrCat(failed, " of ", targets.size(), " failed")),
      ExitCodeOf(first));
}

}  // namespace

void AddMakingOptions(CLI::App* app, ShapeInput input, MakingArguments* a) {
  const bool of_scans = input == ShapeInput::kScan;
  AddSurfaceOutput(app,
                   absl::StrCat("a folder (DIR/) for several ", of_scans ? "scans; " : "meshes; "),
                   &a->surface)
      ->required();
  app->add_option(
      "--server", a->connection.server,
      "HOST:PORT of a rilievod, or several with commas between: the first that answers; "
      "without it the work is done in this process");
  AddServerOptions(app, &a->connection);
  AddReconstructOptions(app, input, &a->options);
  app->add_option("--report", a->report, "write the report as JSON to this file");
  app->add_flag("--json", a->json,
                absl::StrCat("print the report as JSON; several ", of_scans ? "scans" : "meshes",
                             ": a list"));
  app->add_flag("--quiet", a->quiet, "show no progress");
}

absl::Status MakeSurfaces(const MakingArguments& arguments, const std::vector<std::string>& names,
                          const ReadSource& read, const std::vector<std::string>& further_outputs,
                          const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<SurfaceTarget> targets,
                           SurfaceTargets(names, arguments.surface));
  CommandFiles files{
      arguments.inputs, PathsOf(targets), {arguments.report, arguments.json ? "-" : ""}};
  files.inputs.insert(files.inputs.end(), arguments.further_inputs.begin(),
                      arguments.further_inputs.end());
  files.outputs.insert(files.outputs.end(), further_outputs.begin(), further_outputs.end());
  AppendFilesOf(arguments.options, &files.inputs);
  AppendFilesOf(arguments.connection, &files.inputs);
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  RILIEVO_ASSIGN_OR_RETURN(const v1::ReconstructOptions options, OptionsFrom(arguments.options));
  RILIEVO_ASSIGN_OR_RETURN(const WorkingServer server, ConnectOrStart(arguments.connection));
  const ReconstructionClient client(server.channel);
  return targets.size() == 1 ? MakeOne(arguments, read, targets[0], options, client, stop)
                             : MakeMany(arguments, read, targets, options, client, stop);
}

}  // namespace rilievo
