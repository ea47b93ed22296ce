// The server program: options in, signals handled, everything else is ReconstructionServer.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>

#include "CLI/CLI.hpp"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/pipeline/reconstruct.h"
#include "grpcpp/server.h"
#include "server/auth/access_tokens.h"
#include "server/auth/token_file.h"
#include "server/command_line/help_formatter.h"
#include "server/command_line/usage_message.h"
#include "server/conversion/server_options.h"
#include "server/health_probe.h"
#include "server/observability/port/channelz_port.h"
#include "server/observability/port/metrics_port.h"
#include "server/observability/server_log.h"
#include "server/observability/server_metrics.h"
#include "server/os/open_files.h"
#include "server/os/private_files.h"
#include "server/reconstruction_server.h"
#include "server/store/store_backup.h"
#include "server/store/store_check.h"
#include "server/worker/in_worker_process.h"
#include "server/worker/worker_process.h"

namespace rilievo {
namespace {

constexpr std::chrono::seconds kProbeTimeout{3};
constexpr std::chrono::seconds kLastWords{1};  // of the log

struct CommandLine {
  ServerOptions options;
  double keep_days = 7;
  double max_job_seconds = 600, max_idle_seconds = 60, drain_seconds = 30;
  std::string worker;
  bool in_process = false;
  std::string probe, probe_service;
  std::string make_token, token_out;
  bool check_store = false, repair = false;
  std::string backup;
  std::string metrics, channelz;
  std::string log = "json", reflection = "auto";
  double keepalive_seconds = 20, keepalive_timeout_seconds = 10;
};

// As from a variable that is not set: a door meant to be shut would stand open.
std::string NotEmpty(const std::string& value) { return value.empty() ? "is empty" : ""; }

void DeclareOptions(CommandLine* line, CLI::App* app) {
  ServerOptions& options = line->options;
  app->set_version_flag("--version", "rilievod " RILIEVO_VERSION);
  app->add_option("--listen", options.listen,
                  "address to serve on: HOST:PORT (port 0 takes a free one) or unix:PATH")
      ->capture_default_str();
  app->add_option("--max-points", options.max_points, "maximum points of one scan")
      ->capture_default_str();
  app->add_option("--max-bytes", options.max_scan_bytes, "maximum bytes of one scan as it is sent")
      ->capture_default_str();
  app->add_option("--max-surface-faces", options.max_surface_faces,
                  "maximum faces of a surface: control faces times 4^max_level")
      ->capture_default_str();
  app->add_option("--max-concurrent-jobs", options.max_concurrent_jobs,
                  "jobs worked on at the same time")
      ->capture_default_str();
  app->add_option(
         "--queue", options.max_queued_jobs,
         "maximum jobs that upload or wait besides those; one client alone gets half of both")
      ->capture_default_str();
  app->add_option("--threads", options.threads, "maximum threads per job; 0: all")
      ->capture_default_str();
  app->add_option("--max-job-seconds", line->max_job_seconds,
                  "longest work on one job, waiting not counted; also the longest stream that "
                  "uploads a scan at under 4096 bytes/s")
      ->capture_default_str();
  app->add_option("--max-idle-seconds", line->max_idle_seconds,
                  "longest pause between two messages of a call")
      ->capture_default_str();
  app->add_option("--drain-seconds", line->drain_seconds,
                  "time that running jobs get to finish after SIGTERM")
      ->capture_default_str();
  app->add_option("--max-job-memory", options.max_job_memory,
                  "maximum bytes of memory that the worker of one job may map; 0: no limit")
      ->capture_default_str();
  CLI::Option* store =
      app->add_option("--store", options.store, "folder where jobs, scans and surfaces are kept");
  app->add_flag("--ephemeral", options.ephemeral,
                "keep jobs in a temporary folder that ends with this server")
      ->excludes(store);
  app->add_option("--keep-days", line->keep_days,
                  "days that finished jobs and idle scans are kept, by a clock that no step moves")
      ->capture_default_str();
  app->add_option("--keep-bytes", options.keep_bytes,
                  "maximum bytes of all kept scans, surfaces, uploads and job records together")
      ->capture_default_str();
  app->add_option(
         "--owner-bytes", options.owner_bytes,
         "maximum of those bytes for one owner; 0: half of --keep-bytes where callers have names, "
         "else all")
      ->capture_default_str();
  CLI::Option* check =
      app->add_flag("--check-store", line->check_store,
                    "read all of --store, say what is damaged, and end: 0 when nothing is, else 1")
          ->needs(store);
  app->add_flag("--repair", line->repair,
                "with --check-store: set aside what is damaged and save the rest")
      ->needs(check);
  app->add_option("--backup", line->backup,
                  "copy --store, which a server may be using, to this empty folder, and end")
      ->needs(store)
      ->check(NotEmpty);
  app->add_option("--max-waiting-jobs", options.max_waiting_jobs,
                  "maximum kept jobs that are not finished; one client alone gets half")
      ->capture_default_str();
  app->add_option(
         "--memory-budget", options.memory_budget,
         "maximum bytes of memory that the running jobs may need together, by estimate; 0: "
         "80 % of what there is")
      ->capture_default_str();
  app->add_option("--worker", line->worker,
                  "path of the program rilievo-worker; default: the one beside this program");
  app->add_flag("--in-process", line->in_process,
                "work in this process; a job that crashes then ends the server");
  app->add_option("--reflection", line->reflection,
                  "serve the protocol's description: on, off, or auto (on unless callers need a "
                  "token or a certificate)")
      ->check(CLI::IsMember({"on", "off", "auto"}))
      ->capture_default_str();
  app->add_flag_callback(
      "--no-reflection", [line] { line->reflection = "off"; }, "the same as --reflection off");
  app->add_option("--max-calls", options.max_calls,
                  "maximum streams under way, of all clients together; one client alone gets half")
      ->capture_default_str();
  app->add_option("--max-uploads", options.max_uploads,
                  "maximum scans that are being uploaded; one client alone gets half (without "
                  "tokens, all callers behind one gateway, NAT or unix socket are one client)")
      ->capture_default_str();
  app->add_option("--max-server-memory", options.max_server_memory,
                  "maximum bytes of memory that the server itself may take, without workers and "
                  "points; above it the connections that cost most are closed")
      ->capture_default_str();
  app->add_option("--max-connections", options.max_connections, "maximum open connections")
      ->capture_default_str();
  app->add_option("--max-address-connections", options.max_address_connections,
                  "maximum open connections per address; raise it behind a proxy")
      ->capture_default_str();
  app->add_option("--max-connection-streams", options.max_connection_streams,
                  "maximum calls under way per connection")
      ->capture_default_str();
  app->add_option("--keepalive-seconds", line->keepalive_seconds,
                  "silence after which a peer is asked whether it is still there")
      ->capture_default_str();
  app->add_option("--keepalive-timeout-seconds", line->keepalive_timeout_seconds,
                  "longest wait for that answer; then the connection is closed")
      ->capture_default_str();
  app->add_option("--metrics", line->metrics,
                  "HOST:PORT where Prometheus finds GET /metrics; it asks for no token");
  app->add_option("--channelz", line->channelz,
                  "HOST:PORT, a loopback address, for gRPC's own view of its connections");
  app->add_option("--log", line->log,
                  "format of the log on standard error, one line per event: json or text")
      ->check(CLI::IsMember({"json", "text"}))
      ->capture_default_str();
  app->add_option("--tokens", options.tokens,
                  "file of the tokens that callers must have; read again when it changes")
      ->check(NotEmpty);
  app->add_option("--tls-cert", options.tls_certificate,
                  "certificate of this server, a PEM file; without one it speaks plaintext")
      ->check(NotEmpty);
  app->add_option("--tls-key", options.tls_key, "private key of the certificate, a PEM file")
      ->check(NotEmpty);
  app->add_option("--tls-client-ca", options.tls_client_ca,
                  "authorities whose certificates callers must have, a PEM file")
      ->check(NotEmpty);
  app->add_flag("--allow-plaintext", options.allow_plaintext,
                "speak plaintext though other machines reach the address");
  app->add_option("--make-token", line->make_token,
                  "print a new token for this caller, and add its line to the file of --tokens")
      ->check(NotEmpty);
  app->add_option(
         "--token-out", line->token_out,
         "with --make-token: write the token into this new file, which its owner alone may "
         "read")
      ->check(NotEmpty);
  app->add_option("--probe", line->probe,
                  "ask the server at HOST:PORT for its health; exit code 0 (serving) or 1");
  app->add_option("--probe-service", line->probe_service,
                  "service that --probe asks for; alive: whether the server works, also while it "
                  "drains");
}

std::chrono::milliseconds Milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<int64_t>(std::clamp(seconds, -1.0, 1e9) * 1000));
}

int Fail(const absl::Status& status) {
  FlushLog(kLastWords);
  std::fprintf(stderr, "rilievod: %s\n", std::string(status.message()).c_str());
  return 1;
}

int Check(const std::string& store, bool repair) {
  const auto left =
      CheckStore(store, repair, [](const std::string& line) { std::printf("%s\n", line.c_str()); });
  if (!left.ok()) return Fail(left.status());
  std::printf("%lld problems are left\n", static_cast<long long>(*left));
  return *left == 0 ? 0 : 1;
}

// The token into its file, else on standard output, where nothing else goes; the line into the file
// of lines, else beside it.
int PrintNewToken(const std::string& name, const std::string& file, const std::string& token_file) {
  const auto made = MakeToken(name);
  if (!made.ok()) return Fail(made.status());
  if (!token_file.empty()) {
    const absl::Status written = WriteSecret(token_file, made->token + "\n");
    if (!written.ok()) return Fail(written);
  }
  if (file.empty()) {
    std::fprintf(stderr, "line for the file of --tokens:\n%s\n", made->line.c_str());
    if (token_file.empty()) std::fprintf(stderr, "token, shown only now:\n");
  } else if (const absl::Status added = AddTokenLine(file, made->line); !added.ok()) {
    return Fail(added);
  }
  if (token_file.empty()) std::printf("%s\n", made->token.c_str());
  return 0;
}

// Never destroyed: gRPC's threads may have words until the process ends.
ServerLog* StartLog(const CommandLine& line) {
  auto* log = new ServerLog(
      STDERR_FILENO, line.log == "json" ? ServerLog::Format::kJson : ServerLog::Format::kText);
  ServerLog::Use(log);
  return log;
}

// What an operator looks at.
struct OperatorPorts {
  std::unique_ptr<MetricsPort> metrics;
  std::unique_ptr<grpc::Server> channelz;
};

absl::StatusOr<OperatorPorts> OpenPorts(const CommandLine& line,
                                        const ReconstructionServer& server) {
  OperatorPorts ports;
  if (!line.metrics.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(ports.metrics,
                             MetricsPort::Open(line.metrics, server.metrics()->collectable()));
    LogMessage(absl::StrCat("metrics at http://", ports.metrics->address(), "/metrics"));
  }
  if (!line.channelz.empty()) {
    std::string bound;
    RILIEVO_ASSIGN_OR_RETURN(ports.channelz, OpenChannelzPort(line.channelz, &bound));
    LogMessage(absl::StrCat("channelz at ", bound));
  }
  return ports;
}

// Until the running jobs are done, the time is over, or a second signal comes.
void Drain(const sigset_t& signals, std::chrono::milliseconds time, ReconstructionServer* server) {
  const auto end = std::chrono::steady_clock::now() + time;
  const timespec no_wait{};
  while (std::chrono::steady_clock::now() < end) {
    if (server->WaitUntilIdle(std::chrono::milliseconds(100))) return;
    if (sigtimedwait(&signals, nullptr, &no_wait) > 0) return;
  }
}

// A processor second is no longer than a second: the clock's limit comes first.
WorkerSettings SettingsOfWorkers(const CommandLine& line, std::string program) {
  return {.program = std::move(program),
          .memory_bytes = line.options.max_job_memory,
          .processor_seconds = static_cast<int64_t>(line.max_job_seconds) + 10};
}

absl::StatusOr<JobWork> ChooseWork(const CommandLine& line) {
  if (line.in_process) return InThisProcess(ReconstructAndDrop);
  if (line.worker.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(std::string program, WorkerBesideThisProgram());
    return InWorkerProcess(SettingsOfWorkers(line, std::move(program)));
  }
  if (access(line.worker.c_str(), X_OK) != 0) {
    return absl::NotFoundError(absl::StrCat("--worker ", line.worker,
                                            " is not a program; give the path of rilievo-worker"));
  }
  return InWorkerProcess(SettingsOfWorkers(line, line.worker));
}

// What an operator may not know that others can see or do.
void Warn(const ServerOptions& options) {
  for (const auto& [name, path] :
       {std::pair("--tokens", &options.tokens), std::pair("--tls-key", &options.tls_key),
        std::pair("--store", &options.store)}) {
    if (path->empty() || !IsOpenToOthers(*path)) continue;
    LogMessage(absl::StrCat("warning: ", name, " ", *path,
                            " is open to all users of this machine; chmod o= ", *path));
  }
  if (options.allow_plaintext && options.tokens.empty()) {
    LogMessage(absl::StrCat("warning: whoever reaches ", options.listen,
                            " may call, unencrypted and without a token"));
  }
}

int Serve(const CommandLine& line, JobWork work) {
  // Blocked before any thread starts, so that all inherit it and only this one takes them.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  // A log collector that goes away takes nobody's job along.
  std::signal(SIGPIPE, SIG_IGN);
  // A file that may not grow is an error of its write, not the end of the server.
  std::signal(SIGXFSZ, SIG_IGN);
  RaiseOpenFiles();
  KeepToThisUser();

  ServerLog* const log = StartLog(line);
  Warn(line.options);
  auto server = ReconstructionServer::Listen(line.options, std::move(work),
                                             [log](const JobRecord& record) { log->Job(record); });
  if (!server.ok()) return Fail(server.status());
  const auto ports = OpenPorts(line, **server);
  if (!ports.ok()) return Fail(ports.status());
  std::printf("rilievod listening on %s\n", (*server)->address().c_str());
  std::fflush(stdout);

  int signal = 0;
  sigwait(&signals, &signal);
  LogMessage("draining");
  (*server)->BeginDrain();
  Drain(signals, line.options.drain_time, server->get());
  (*server)->Shutdown();
  LogMessage("ended");
  FlushLog(kLastWords);
  return 0;
}

int Main(int argc, char** argv) {
  CommandLine line;
  CLI::App app{"Reconstructs displaced subdivision surfaces from point clouds, over gRPC."};
  app.name("rilievod");
  app.formatter(std::make_shared<HelpFormatter>());
  DeclareOptions(&line, &app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::fputs(UsageMessage(app, {argv + 1, argv + argc}, error).c_str(), stderr);
    return error.get_exit_code();
  }
  if (!line.make_token.empty()) {
    return PrintNewToken(line.make_token, line.options.tokens, line.token_out);
  }
  if (line.check_store) return Check(line.options.store, line.repair);
  if (!line.backup.empty()) {
    const absl::Status done = BackUpStore(line.options.store, line.backup);
    return done.ok() ? 0 : Fail(done);
  }
  if (!line.probe.empty()) {
    const absl::Status health = ProbeHealth(line.probe, kProbeTimeout, line.probe_service);
    return health.ok() ? 0 : Fail(health);
  }
  for (const auto& [name, seconds] :
       {std::pair("--max-job-seconds", line.max_job_seconds),
        std::pair("--max-idle-seconds", line.max_idle_seconds),
        std::pair("--drain-seconds", line.drain_seconds),
        std::pair("--keepalive-seconds", line.keepalive_seconds),
        std::pair("--keepalive-timeout-seconds", line.keepalive_timeout_seconds)}) {
    if (std::isfinite(seconds)) continue;
    return Fail(absl::InvalidArgumentError(
        absl::StrCat(name, " ", seconds, " is not a number of seconds; give for example 60")));
  }
  line.options.max_job_time = Milliseconds(line.max_job_seconds);
  line.options.max_idle_time = Milliseconds(line.max_idle_seconds);
  line.options.keep_time = Milliseconds(std::min(line.keep_days, 10'000.0) * 24 * 3600);
  line.options.drain_time = Milliseconds(line.drain_seconds);
  line.options.keepalive_time = Milliseconds(line.keepalive_seconds);
  line.options.keepalive_timeout = Milliseconds(line.keepalive_timeout_seconds);
  const bool anybody = line.options.tokens.empty() && line.options.tls_client_ca.empty();
  line.options.reflection = line.reflection == "on" || (line.reflection == "auto" && anybody);
  // Then the memory of jobs is the server's own.
  if (line.in_process) line.options.max_server_memory += line.options.MemoryBudget();
  auto work = ChooseWork(line);
  if (!work.ok()) return Fail(work.status());
  return Serve(line, *std::move(work));
}

}  // namespace
}  // namespace rilievo

int main(int argc, char** argv) { return rilievo::Main(argc, argv); }
