// rilievo jobs ...: reconstructions that a server keeps.
#include <CLI/CLI.hpp>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/job_words.h"
#include "client/cli/loaded_shape.h"
#include "client/cli/output_target.h"
#include "client/cli/place_options.h"
#include "client/cli/progress_display.h"
#include "client/cli/reconstruct_options.h"
#include "client/cli/report_output.h"
#include "client/cli/scan_set.h"
#include "client/cli/server_connection.h"
#include "client/cli/server_words.h"
#include "client/cli/surface_output.h"
#include "client/library/jobs_client.h"
#include "client/library/status_conversion.h"
#include "core/base/status_macros.h"
#include "server/command_line/real_range.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

struct JobsArguments {
  ServerArguments connection;
  std::string scan, request_id, job_id;
  std::string base;  // a surface to bring up to date
  SurfaceOutputArguments surface;
  ScanArguments reading;
  ReconstructArguments options, mesh_options;  // of submit, of convert
  std::optional<double> timeout_seconds;
  size_t limit = 20;
  bool whole = false, wait = false, json = false, quiet = false;
};

absl::StatusOr<JobsClient> ClientOf(const JobsArguments& arguments) {
  RILIEVO_ASSIGN_OR_RETURN(const auto channels, ConnectTo(arguments.connection));
  return JobsClient(channels);
}

CallOptions CallOf(const JobsArguments& arguments, std::stop_token stop) {
  CallOptions call;
  call.stop = std::move(stop);
  if (arguments.timeout_seconds) {
    call.timeout =
        std::chrono::milliseconds(static_cast<int64_t>(1000 * *arguments.timeout_seconds));
  }
  return call;
}

void Print(const v1::Job& job, const JobsArguments& arguments) {
  if (arguments.json) {
    std::cout << JsonOf(job).dump(2) << '\n';
  } else {
    WordsBeside(arguments.surface.output) << WordsOf(job);
  }
}

// Where the surface goes; what it is made from is not overwritten.
absl::StatusOr<SurfaceTarget> CheckedTarget(const JobsArguments& arguments) {
  RILIEVO_ASSIGN_OR_RETURN(SurfaceTarget target, SurfaceTargetOf(arguments.surface));
  CommandFiles files{{arguments.scan, arguments.base, arguments.reading.trajectory},
                     PathsOf({target}),
                     {arguments.json ? "-" : ""}};
  AppendFilesOf(arguments.options, &files.inputs);
  AppendFilesOf(arguments.connection, &files.inputs);
  RILIEVO_RETURN_IF_ERROR(CheckFiles(files));
  return target;
}

// What a job that did not succeed means for the one who waited for it.
absl::Status StatusOfEnd(const v1::Job& job) {
  if (job.state() == v1::JOB_STATE_FAILED) {
    const absl::Status error = StatusFromRpc(job.error());
    return absl::Status(error.code(), WordsOf(error));
  }
  if (job.state() == v1::JOB_STATE_CANCELLED) return absl::CancelledError("it was cancelled");
  return absl::OkStatus();
}

absl::StatusOr<v1::Job> Watch(const JobsArguments& arguments, const std::string& job_id,
                              const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const JobsClient client, ClientOf(arguments));
  ProgressDisplay display(
      arguments.quiet ? ProgressDisplay::Style::kNone : ProgressDisplay::StyleOfStandardError(),
      std::cerr);
  const auto show = [&](const v1::JobEvent& event) {
    if (!event.has_progress() || event.progress().stage() < v1::STAGE_CHECK) return;
    display.Update(event.progress().stage() - v1::STAGE_CHECK + 1,
                   v1::Stage_MAX - v1::STAGE_CHECK + 1, StageLabel(event.progress().stage()),
                   event.progress().fraction());
  };
  RILIEVO_ASSIGN_OR_RETURN(const v1::Job job, client.Watch(job_id, show, CallOf(arguments, stop)));
  if (job.state() == v1::JOB_STATE_SUCCEEDED) display.Finish();
  return job;
}

// `known`: the beginning of the file, which is here.
absl::Status Fetch(const JobsArguments& arguments, const SurfaceTarget& target,
                   const std::string& job_id, const std::stop_token& stop,
                   std::vector<uint8_t> known = {}) {
  RILIEVO_ASSIGN_OR_RETURN(const JobsClient client, ClientOf(arguments));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> surface,
                           client.Fetch(job_id, {}, CallOf(arguments, stop), std::move(known)));
  RunContext context;
  context.stop = stop;
  RILIEVO_RETURN_IF_ERROR(WriteSurface(target, surface, context));
  if (arguments.json) return absl::OkStatus();
  for (const std::string& path : PathsOf({target})) {
    WordsBeside(path) << path << ": written";
    if (path != target.path || !target.is_mesh())
      WordsBeside(path) << ", " << surface.size() << " bytes";
    WordsBeside(path) << '\n';
  }
  return absl::OkStatus();
}

std::string RandomRequestId() {
  std::random_device random;
  return absl::StrCat("cli-", absl::Hex(random(), absl::kZeroPad8),
                      absl::Hex(random(), absl::kZeroPad8));
}

absl::StatusOr<ScanFile> LoadInput(const JobsArguments& arguments,
                                   const ReconstructArguments& wanted) {
  const WantedLayers layers = LayersFor(wanted);
  if (wanted.input != ShapeInput::kScan) {
    return LoadMesh(arguments.scan, arguments.reading.format, layers.colors);
  }
  RILIEVO_ASSIGN_OR_RETURN(ScanFile scan, LoadScan(arguments.scan, arguments.reading, layers));
  RILIEVO_RETURN_IF_ERROR(ColorAsAsked(wanted, arguments.scan, &scan));
  return scan;
}

// What the job is made of, and the surface that it brings up to date, if any.
struct JobInput {
  PackedScan packed;
  v1::ReconstructOptions options;
  std::vector<uint8_t> base;
};

absl::StatusOr<JobInput> ReadInput(const JobsArguments& arguments,
                                   const ReconstructArguments& wanted,
                                   const std::stop_token& stop) {
  JobInput input;
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile scan, LoadInput(arguments, wanted));
  if (arguments.base.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(input.options, OptionsFrom(wanted));
    RILIEVO_RETURN_IF_ERROR(SetPlace(wanted, arguments.scan, scan.place, &input.options));
    input.packed = PackScan(scan.cloud);
    return input;
  }
  RunContext context;
  context.stop = stop;
  RILIEVO_ASSIGN_OR_RETURN(input.base, ReadBytes(arguments.base));
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface own,
                           DecodeBytes(arguments.base, input.base, context));
  RILIEVO_RETURN_IF_ERROR(
      CheckSamePlace(arguments.base, own.metadata.place, arguments.scan,
                     PlaceOf(wanted.place, Completed(scan.place, own.metadata.place))));
  if (wanted.threads) input.options.set_threads(*wanted.threads);
  input.packed =
      PackUpdate({scan.cloud.points}, {.dss = input.base,
                                       .vertices = static_cast<int64_t>(own.surface.heights.size()),
                                       .whole = arguments.whole});
  return input;
}

// A scan or a mesh, as `wanted` says.
absl::Status Submit(const JobsArguments& arguments, const ReconstructArguments& wanted,
                    const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceTarget target, CheckedTarget(arguments));
  RILIEVO_ASSIGN_OR_RETURN(const JobsClient client, ClientOf(arguments));
  RILIEVO_ASSIGN_OR_RETURN(JobInput input, ReadInput(arguments, wanted, stop));
  const std::string request_id =
      arguments.request_id.empty() ? RandomRequestId() : arguments.request_id;
  absl::StatusOr<v1::Job> submitted =
      client.Submit(input.packed, input.options, request_id, {}, CallOf(arguments, stop));
  if (!submitted.ok()) {
    return absl::Status(submitted.status().code(), WordsOf(submitted.status()));
  }
  v1::Job job = *std::move(submitted);
  if (!arguments.wait && arguments.surface.output.empty()) {
    Print(job, arguments);
    return absl::OkStatus();
  }
  RILIEVO_ASSIGN_OR_RETURN(job, Watch(arguments, job.job_id(), stop));
  Print(job, arguments);
  RILIEVO_RETURN_IF_ERROR(StatusOfEnd(job));
  return arguments.surface.output.empty()
             ? absl::OkStatus()
             : Fetch(arguments, target, job.job_id(), stop, std::move(input.base));
}

absl::Status RunSubmit(const JobsArguments& arguments, const std::stop_token& stop) {
  return Submit(arguments, arguments.options, stop);
}

absl::Status RunConvert(const JobsArguments& arguments, const std::stop_token& stop) {
  return Submit(arguments, arguments.mesh_options, stop);
}

absl::Status RunList(const JobsArguments& arguments, const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const JobsClient client, ClientOf(arguments));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<v1::Job> jobs,
                           client.List(arguments.limit, CallOf(arguments, stop)));
  if (arguments.json) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const v1::Job& job : jobs) all.push_back(JsonOf(job));
    std::cout << all.dump(2) << '\n';
    return absl::OkStatus();
  }
  for (const v1::Job& job : jobs) {
    std::cout << job.job_id() << "  " << TimeText(job.create_time()) << "  "
              << StateName(job.state()) << "  " << job.request_id() << '\n';
  }
  return absl::OkStatus();
}

absl::Status RunShow(const JobsArguments& arguments, const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const JobsClient client, ClientOf(arguments));
  RILIEVO_ASSIGN_OR_RETURN(const v1::Job job,
                           client.Get(arguments.job_id, CallOf(arguments, stop)));
  Print(job, arguments);
  return absl::OkStatus();
}

absl::Status RunWatch(const JobsArguments& arguments, const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const v1::Job job, Watch(arguments, arguments.job_id, stop));
  Print(job, arguments);
  return StatusOfEnd(job);
}

absl::Status RunCancel(const JobsArguments& arguments, const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const JobsClient client, ClientOf(arguments));
  RILIEVO_ASSIGN_OR_RETURN(const v1::Job job,
                           client.Cancel(arguments.job_id, CallOf(arguments, stop)));
  Print(job, arguments);
  return absl::OkStatus();
}

absl::Status RunDelete(const JobsArguments& arguments, const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const JobsClient client, ClientOf(arguments));
  RILIEVO_RETURN_IF_ERROR(client.Delete(arguments.job_id, CallOf(arguments, stop)));
  if (arguments.json) {
    std::cout << nlohmann::ordered_json{{"job_id", arguments.job_id}, {"deleted", true}}.dump(2)
              << '\n';
  }
  return absl::OkStatus();
}

absl::Status RunDeleteScan(const JobsArguments& arguments, const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const JobsClient client, ClientOf(arguments));
  RILIEVO_RETURN_IF_ERROR(client.DeleteScan(arguments.scan, CallOf(arguments, stop)));
  if (arguments.json) {
    std::cout << nlohmann::ordered_json{{"scan_id", arguments.scan}, {"deleted", true}}.dump(2)
              << '\n';
  }
  return absl::OkStatus();
}

absl::Status RunFetch(const JobsArguments& arguments, const std::stop_token& stop) {
  RILIEVO_ASSIGN_OR_RETURN(const SurfaceTarget target, CheckedTarget(arguments));
  RILIEVO_RETURN_IF_ERROR(Fetch(arguments, target, arguments.job_id, stop));
  if (arguments.json) return RunShow(arguments, stop);
  return absl::OkStatus();
}

CLI::App* AddCommand(CLI::App* jobs, const std::string& name, const std::string& words,
                     JobsArguments* a) {
  CLI::App* app = jobs->add_subcommand(name, words);
  app->add_option("--server", a->connection.server,
                  "HOST:PORT of a rilievod that keeps jobs; or several over one store, with commas "
                  "between: where one is away, another is asked")
      ->required();
  AddServerOptions(app, &a->connection);
  app->add_option("--timeout", a->timeout_seconds,
                  "seconds for all attempts together; default no limit")
      ->check(RealRange(CLI::PositiveNumber));
  return app;
}

// One that is about a job.
CLI::App* AddJobCommand(CLI::App* jobs, const std::string& name, const std::string& words,
                        JobsArguments* a) {
  CLI::App* app = AddCommand(jobs, name, words, a);
  app->add_option("JOB", a->job_id, "id of the job")->required();
  return app;
}

// `first`: of the options about how a surface is made, which one that is brought up to date keeps.
void AddBase(CLI::App* app, size_t first, JobsArguments* a) {
  const std::vector<CLI::Option*> options = app->get_options();
  CLI::Option* base = app->add_option(
      "--base", a->base,
      "a surface, a .dss file, that the scan brings up to date as rilievo update does");
  app->add_flag("--whole", a->whole, "of --base: the scan shows all there is to see")->needs(base);
  for (size_t i = first; i < options.size(); ++i) {
    const std::string name = options[i]->get_name();
    const bool of_any =
        name == "--threads" || name == "--unit" || name == "--up" || name == "--crs";
    if (!of_any) base->excludes(options[i]);
  }
}

void AddSubmit(CLI::App* app, ShapeInput input, JobsArguments* a) {
  const bool of_scans = input == ShapeInput::kScan;
  app->add_option(of_scans ? "SCAN" : "MESH", a->scan,
                  of_scans ? "the points: PLY, PCD, XYZ, PTS, TXT, OBJ, LAS, LAZ, E57, PTX; - is "
                             "standard input"
                           : "the mesh: PLY, OBJ, STL, GLB; - is standard input")
      ->required();
  app->add_option(
      "--request-id", a->request_id,
      "id of this request, of letters, digits, '-' and '_'; the same id never makes a second job");
  app->add_flag("--wait", a->wait, "wait until the job is finished");
  AddSurfaceOutput(app, "the command then waits for it; ", &a->surface);
  AddFormatOption(app, &a->reading.format);
  if (of_scans) {
    AddScanOptions(app, &a->reading);
    AddTrajectoryOption(app, &a->reading);
  }
  const size_t others = app->get_options().size();
  AddReconstructOptions(app, input, of_scans ? &a->options : &a->mesh_options);
  if (of_scans) AddBase(app, others, a);
}

}  // namespace

Command AddJobs(CLI::App& program) {
  CLI::App* jobs = program.add_subcommand("jobs", "Work with the jobs that a server keeps");
  jobs->require_subcommand(1);
  const auto a = std::make_shared<JobsArguments>();
  using Run = absl::Status (*)(const JobsArguments&, const std::stop_token&);
  std::vector<std::pair<CLI::App*, Run>> commands;
  const auto add = [&](CLI::App* app, Run run) {
    commands.emplace_back(app, run);
    return app;
  };
  CLI::App* submit =
      add(AddCommand(jobs, "submit", "Upload a scan and queue a job", a.get()), RunSubmit);
  AddSubmit(submit, ShapeInput::kScan, a.get());
  CLI::App* convert =
      add(AddCommand(jobs, "convert", "Upload a mesh and queue a job", a.get()), RunConvert);
  AddSubmit(convert, ShapeInput::kMesh, a.get());
  CLI::App* list = add(AddCommand(jobs, "list", "List the latest jobs", a.get()), RunList);
  list->add_option("--limit", a->limit, "largest number of jobs")->capture_default_str();
  CLI::App* show =
      add(AddJobCommand(jobs, "show", "Show what is known of a job", a.get()), RunShow);
  CLI::App* watch =
      add(AddJobCommand(jobs, "watch", "Follow a job until it is finished", a.get()), RunWatch);
  CLI::App* fetch =
      add(AddJobCommand(jobs, "fetch", "Write the surface of a job", a.get()), RunFetch);
  AddSurfaceOutput(fetch, "", &a->surface)->required();
  CLI::App* cancel = add(AddJobCommand(jobs, "cancel", "End a job", a.get()), RunCancel);
  CLI::App* remove = add(
      AddJobCommand(jobs, "delete", "Remove a job, its surface and its scan", a.get()), RunDelete);
  CLI::App* remove_scan = add(
      AddCommand(jobs, "delete-scan", "Remove a scan that was uploaded", a.get()), RunDeleteScan);
  remove_scan->add_option("SCAN_ID", a->scan, "as `jobs show` tells it")->required();
  for (CLI::App* app : {submit, convert, list, show, watch, fetch, cancel, remove, remove_scan}) {
    app->add_flag("--json", a->json, "print JSON");
  }
  for (CLI::App* app : {submit, convert, watch})
    app->add_flag("--quiet", a->quiet, "show no progress");
  return {jobs, [a, commands](const std::stop_token& stop) {
            for (const auto& [app, run] : commands) {
              if (app->parsed()) return run(*a, stop);
            }
            return absl::InvalidArgumentError("no command");
          }};
}

}  // namespace rilievo
