#include <CLI/CLI.hpp>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/progress_display.h"
#include "client/cli/report_output.h"
#include "client/cli/server_connection.h"
#include "client/cli/text_layout.h"
#include "client/formats/atomic_file.h"
#include "client/formats/mesh_reader.h"
#include "client/formats/scan_reader.h"
#include "client/library/point_packing.h"
#include "client/library/reconstruction_client.h"
#include "core/base/status_macros.h"
#include "server/embedded_server.h"

namespace rilievo {
namespace {

struct ReconstructArguments {
  std::string scan, output, report, control_mesh;
  ServerArguments connection;
  std::string topology = "auto", boundary = "keep", creases = "auto", fit;
  std::optional<uint32_t> max_level, control_faces, threads;
  std::optional<uint64_t> seed;
  std::optional<double> height_step, max_error;
  std::optional<uint64_t> max_bytes;
  bool no_measure = false, quiet = false, json = false;
};

// The given mesh as the protocol carries it, scan frame.
absl::StatusOr<v1::ControlMesh> ReadControlMesh(const std::string& path) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshFile file, ReadMesh(path));
  if (file.mesh.triangles.cols() == 0) {
    return absl::InvalidArgumentError(absl::StrCat(
        path, ": holds no faces; the control mesh must be a triangle mesh (OBJ, PLY, STL)"));
  }
  v1::ControlMesh mesh;
  PointCloud vertices{file.mesh.vertices};
  mesh.set_positions(
      PackPoints(vertices, 0, vertices.points.cols(), v1::COORDINATE_FORMAT_FLOAT64_LE));
  for (Eigen::Index i = 0; i < file.mesh.triangles.size(); ++i) {
    mesh.add_faces(static_cast<uint32_t>(file.mesh.triangles.data()[i]));
  }
  return mesh;
}

absl::StatusOr<v1::ReconstructOptions> OptionsFrom(const ReconstructArguments& arguments) {
  v1::ReconstructOptions options;
  if (arguments.max_level) options.set_max_level(*arguments.max_level);
  if (arguments.threads) options.set_threads(*arguments.threads);
  if (arguments.seed) options.set_seed(*arguments.seed);
  if (arguments.no_measure) options.set_measure(false);
  v1::ControlOptions& control = *options.mutable_control();
  const std::map<std::string, v1::Topology> topologies = {{"auto", v1::TOPOLOGY_AUTO},
                                                          {"planar", v1::TOPOLOGY_PLANAR},
                                                          {"spherical", v1::TOPOLOGY_SPHERICAL},
                                                          {"arbitrary", v1::TOPOLOGY_ARBITRARY}};
  control.set_boundary(arguments.boundary == "close" ? v1::BOUNDARY_CLOSE : v1::BOUNDARY_KEEP);
  control.set_creases(arguments.creases == "auto" ? v1::CREASES_AUTO : v1::CREASES_OFF);
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
  if (arguments.height_step)
    options.mutable_encode()->set_height_step_ratio(*arguments.height_step);
  if (arguments.max_error) options.mutable_encode()->set_max_error_ratio(*arguments.max_error);
  if (arguments.max_bytes) options.mutable_encode()->set_max_bytes(*arguments.max_bytes);
  return options;
}

// Limits for one's own machine and scan: a server's are there to protect it from strangers.
ServerOptions LimitsForOneself() {
  ServerOptions options;
  options.max_points = std::numeric_limits<int32_t>::max();
  options.max_scan_bytes = 24 * options.max_points;
  options.max_surface_faces = std::numeric_limits<int32_t>::max();
  options.max_concurrent_jobs = 1;
  options.memory_budget = std::numeric_limits<int64_t>::max();
  options.max_job_time = std::chrono::hours(24 * 7);
  options.max_idle_time = std::chrono::hours(24 * 7);
  return options;
}

// A connection, and the server behind it when that is in this process.
struct Connection {
  std::unique_ptr<EmbeddedServer> embedded;
  std::shared_ptr<grpc::ChannelInterface> channel;
};

absl::StatusOr<Connection> Connect(const ServerArguments& server) {
  Connection connection;
  if (!server.server.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(connection.channel, ConnectTo(server));
    return connection;
  }
  RILIEVO_ASSIGN_OR_RETURN(connection.embedded, EmbeddedServer::Start(LimitsForOneself()));
  connection.channel = connection.embedded->channel();
  return connection;
}

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

// The options are the server's to judge; here the field names of the protocol become options of the
// command line.
absl::Status Explain(const absl::Status& status, const ReconstructArguments& arguments) {
  if (status.ok()) return status;
  std::string message(status.message());
  if (status.code() == absl::StatusCode::kUnavailable && !arguments.connection.server.empty()) {
    message =
        absl::StrCat("the server at ", arguments.connection.server, " is unavailable: ", message,
                     "\nIs rilievod running there? Without --server the work is done here.");
  } else if (status.code() == absl::StatusCode::kCancelled) {
    message = "cancelled; nothing was written";
  } else if (status.code() != absl::StatusCode::kResourceExhausted) {
    message = absl::StrCat(arguments.scan, ": ", message);
  }
  return absl::Status(status.code(), message);
}

absl::Status Reconstruct(const ReconstructArguments& arguments, std::stop_token stop) {
  for (const std::string& path : {arguments.output, arguments.report}) {
    if (path.empty()) continue;
    RILIEVO_RETURN_IF_ERROR(WithExitCode(CheckWritable(path), ExitCode::kOutput));
  }
  RILIEVO_ASSIGN_OR_RETURN(const v1::ReconstructOptions options, OptionsFrom(arguments));
  RILIEVO_ASSIGN_OR_RETURN(const ScanFile scan, ReadScan(arguments.scan));
  RILIEVO_ASSIGN_OR_RETURN(const Connection connection, Connect(arguments.connection));

  ProgressDisplay display(
      arguments.quiet ? ProgressDisplay::Style::kNone : ProgressDisplay::StyleOfStandardError(),
      std::cerr);
  const ReconstructionClient client(connection.channel);
  CallOptions call;
  call.stop = stop;
  const absl::StatusOr<ReconstructResult> result = client.Reconstruct(
      scan.cloud, options,
      ShowProgress(scan.cloud.points.cols(), !arguments.connection.server.empty(), &display), call);
  if (!result.ok()) return Explain(result.status(), arguments);
  display.Finish();

  const ReportPaths paths{arguments.scan, scan.format, arguments.output};
  RILIEVO_RETURN_IF_ERROR(
      WithExitCode(WriteBytesAtomically(arguments.output, result->dss), ExitCode::kOutput));
  const std::string json = ReportJson(result->report, paths);
  if (!arguments.report.empty()) {
    const absl::Status written = WriteFileAtomically(arguments.report, [&](std::ostream& out) {
      out << json;
      return absl::OkStatus();
    });
    RILIEVO_RETURN_IF_ERROR(WithExitCode(written, ExitCode::kOutput));
  }
  std::cout << (arguments.json ? json : ReportText(result->report, paths));
  return absl::OkStatus();
}

}  // namespace

Command AddReconstruct(CLI::App& program) {
  CLI::App* app = program.add_subcommand("reconstruct", "Make a surface from a scan");
  const auto a = std::make_shared<ReconstructArguments>();
  app->add_option("SCAN", a->scan,
                  "the points: PLY, PCD, XYZ, PTS, TXT or OBJ; - is standard input")
      ->required();
  app->add_option("-o,--output", a->output, "the surface, a .dss file")->required();
  app->add_option("--server", a->connection.server,
                  "HOST:PORT of a rilievod; without it the work is done in this process");
  AddServerOptions(app, &a->connection);
  app->add_option("--topology", a->topology,
                  "auto, planar (one sheet over a plane), spherical "
                  "(star-shaped) or arbitrary")
      ->check(CLI::IsMember({"auto", "planar", "spherical", "arbitrary"}))
      ->capture_default_str();
  CLI::Option* mesh =
      app->add_option("--control-mesh", a->control_mesh,
                      "start from this triangle mesh (OBJ, PLY, STL), in the scan's coordinates");
  app->get_option("--topology")->excludes(mesh);
  app->add_option("--boundary", a->boundary, "keep an open scan open, or close it")
      ->check(CLI::IsMember({"keep", "close"}))
      ->capture_default_str();
  app->add_option("--creases", a->creases,
                  "auto: sharp edges of the scan become creases of the surface; off: none do")
      ->check(CLI::IsMember({"auto", "off"}))
      ->capture_default_str();
  app->add_option("--max-level", a->max_level, "levels of heights; default as dense as the points")
      ->check(CLI::Range(0, 8));
  app->add_option("--control-faces", a->control_faces,
                  "about how many; default chosen from the points")
      ->check(CLI::Range(0, 200000))
      ->excludes(mesh);
  app->add_option("--threads", a->threads, "default all")->check(CLI::Range(0, 1024));
  app->add_option("--report", a->report, "write the report as JSON to this file");
  app->add_flag("--json", a->json, "print the report as JSON");
  app->add_flag("--quiet", a->quiet, "show no progress");
  app->add_option("--fit", a->fit, "suzuki (fast) or least-squares (default, closer)")
      ->check(CLI::IsMember({"suzuki", "least-squares"}));
  CLI::Option* error =
      app->add_option("--max-error", a->max_error,
                      "RMS error of the surface in the file, fraction of the diagonal; default "
                      "next to its own")
          ->check(CLI::Range(1e-6, 0.1));
  CLI::Option* bytes =
      app->add_option("--max-bytes", a->max_bytes, "bytes of the file, as good as they allow")
          ->check(CLI::Range(uint64_t{1}, uint64_t{1} << 40))
          ->excludes(error);
  app->add_option("--height-step", a->height_step,
                  "step of the height quantiser, fraction of the diagonal")
      ->check(CLI::Range(1e-9, 0.01))
      ->excludes(error)
      ->excludes(bytes);
  app->add_option("--seed", a->seed, "of all random choices; default 0");
  app->add_flag("--no-measure", a->no_measure, "do not measure the error at the end");
  return {app, [a](std::stop_token stop) { return Reconstruct(*a, stop); }};
}

}  // namespace rilievo
