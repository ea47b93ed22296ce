// The server program: options in, signals handled, everything else is ReconstructionServer.
#include <unistd.h>

#include <chrono>
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
#include "server/os/out_of_memory.h"
#include "server/os/private_files.h"
#include "server/postgres/postgres_database.h"
#include "server/postgres/postgres_store.h"
#include "server/reconstruction_server.h"
#include "server/rilievod/daemon_options.h"
#include "server/s3/s3_credentials.h"
#include "server/s3/s3_place.h"
#include "server/store/store_backup.h"
#include "server/store/store_check.h"
#include "server/worker/in_worker_process.h"
#include "server/worker/worker_process.h"

namespace rilievo {
namespace {

constexpr std::chrono::seconds kProbeTimeout{3};
constexpr std::chrono::seconds kLastWords{1};  // of the log

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
  if (line.in_process) return InServerProcess(ReconstructAndDrop);
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
  const std::string credentials = IsS3Url(options.blobs) ? S3CredentialsFile() : "";
  for (const auto& [name, path] :
       {std::pair("--tokens", &options.tokens), std::pair("--tls-key", &options.tls_key),
        std::pair("--store", &options.store), std::pair("credentials of S3", &credentials)}) {
    if (path->empty() || IsPostgresUrl(*path) || !IsOpenToOthers(*path)) continue;
    LogMessage(absl::StrCat("warning: ", name, " ", *path,
                            " is open to all users of this machine; chmod o= ", *path));
  }
  if (options.allow_plaintext && options.tokens.empty()) {
    LogMessage(absl::StrCat("warning: whoever reaches ", options.listen,
                            " may call, unencrypted and without a token"));
  }
}

absl::StatusOr<std::unique_ptr<JobStore>> OpenStoreOf(const ServerOptions& options,
                                                      StoreSettings settings) {
  if (!IsPostgresUrl(options.store)) return OpenFolder(options, std::move(settings));
  return OpenPostgresStore(options.store, options.blobs, std::move(settings));
}

// Until a signal comes, or there was nothing to work on for that long, if that is not below 0.
void WaitForEnd(const sigset_t& signals, double idle_seconds, const ReconstructionServer& server) {
  if (idle_seconds < 0) {
    int signal = 0;
    sigwait(&signals, &signal);
    return;
  }
  constexpr timespec kPause{0, 100'000'000};
  const std::chrono::duration<double> enough(idle_seconds);
  while (server.IdleTime() < enough && sigtimedwait(&signals, nullptr, &kPause) <= 0) continue;
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
  EndWithoutMemory();
  RaiseOpenFiles();
  KeepToThisUser();

  ServerLog* const log = StartLog(line);
  Warn(line.options);
  const auto start = line.work_only ? ReconstructionServer::Embed : ReconstructionServer::Listen;
  auto server = start(
      line.options, std::move(work), [log](const JobRecord& record) { log->Job(record); },
      OpenStoreOf);
  if (!server.ok()) return Fail(server.status());
  const auto ports = OpenPorts(line, **server);
  if (!ports.ok()) return Fail(ports.status());
  std::printf("rilievod %s\n",
              line.work_only ? "working" : ("listening on " + (*server)->address()).c_str());
  std::fflush(stdout);

  WaitForEnd(signals, line.until_idle_seconds, **server);
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
  if (const absl::Status wrong = CompleteOptions(&line); !wrong.ok()) return Fail(wrong);
  if (line.check_store) return Check(line.options.store, line.repair);
  if (!line.backup.empty()) {
    const absl::Status done = BackUpStore(line.options.store, line.backup);
    return done.ok() ? 0 : Fail(done);
  }
  if (!line.probe.empty()) {
    const absl::Status health = ProbeHealth(line.probe, kProbeTimeout, line.probe_service);
    return health.ok() ? 0 : Fail(health);
  }
  auto work = ChooseWork(line);
  if (!work.ok()) return Fail(work.status());
  return Serve(line, *std::move(work));
}

}  // namespace
}  // namespace rilievo

int main(int argc, char** argv) { return rilievo::Main(argc, argv); }
