#include "server/rilievod/daemon_options.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/command_line/real_range.h"
#include "server/postgres/postgres_database.h"
#include "server/postgres/postgres_store.h"

namespace rilievo {
namespace {

// As from a variable that is not set: a door meant to be shut would stand open.
std::string NotEmpty(const std::string& value) { return value.empty() ? "is empty" : ""; }

std::chrono::milliseconds Milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<int64_t>(std::clamp(seconds, -1.0, 1e9) * 1000));
}

absl::Status CheckStorePlace(const CommandLine& line) {
  const ServerOptions& options = line.options;
  if (IsPostgresUrl(options.store)) {
    RILIEVO_RETURN_IF_ERROR(CheckPostgresUrl(options.store));
    RILIEVO_RETURN_IF_ERROR(CheckBlobsUrl(options.blobs));
    if (!line.check_store && line.backup.empty()) return absl::OkStatus();
    return absl::InvalidArgumentError(
        "--check-store and --backup are for a folder; use PostgreSQL's own pg_amcheck and pg_dump, "
        "and copy the folder or bucket of --blobs after the dump");
  }
  if (options.store.find("://") != std::string::npos) {
    return absl::InvalidArgumentError(
        "--store is neither a folder nor a URL that begins with postgres://");
  }
  for (const auto& [name, given] :
       {std::pair("--blobs", !options.blobs.empty()), std::pair("--serve-only", options.serve_only),
        std::pair("--work-only", line.work_only)}) {
    if (!given) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(name, " is for a store that servers share; give --store postgres://..."));
  }
  return absl::OkStatus();
}

}  // namespace

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
  CLI::Option* scratch =
      app->add_option(
             "--scratch", options.scratch,
             "folder for scans that need more memory than a job may take, with room for 60 "
             "bytes per point: they are made by parts, of the places of their points alone; "
             "default: they are refused")
          ->check(NotEmpty);
  app->add_option(
         "--part-points", options.part_points,
         "points of such a part: fewer take less memory, 85 MB and 1.3 to 1.9 KB per point, and "
         "less detail; give all servers and workers the same")
      ->needs(scratch)
      ->capture_default_str();
  CLI::Option* store =
      app->add_option("--store", options.store,
                      "where jobs are kept: a folder for this server alone, with scans and "
                      "surfaces; or postgres://..., which many servers share (without a password: "
                      "that belongs in ~/.pgpass, PGPASSFILE or a service file)");
  app->add_option("--blobs", options.blobs,
                  "with --store postgres://...: where scans and surfaces are kept; pg: (the same "
                  "database, the default), file:FOLDER, which all servers have, or "
                  "s3://BUCKET[/PREFIX][?endpoint=URL&region=NAME], with credentials from AWS_... "
                  "variables or ~/.aws/credentials")
      ->needs(store);
  CLI::Option* serve_only =
      app->add_flag("--serve-only", options.serve_only,
                    "with --store postgres://...: answer calls and leave kept jobs to others")
          ->needs(store);
  CLI::Option* work_only =
      app->add_flag("--work-only", line->work_only,
                    "with --store postgres://...: work on kept jobs and answer no calls")
          ->needs(store)
          ->excludes(serve_only);
  app->add_option("--until-idle", line->until_idle_seconds,
                  "with --work-only: end when there was nothing to work on for so many seconds")
      ->needs(work_only)
      ->check(RealRange(CLI::NonNegativeNumber));
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
                "work in this process; a job that crashes or runs out of memory then ends "
                "the server");
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

absl::Status CompleteOptions(CommandLine* line) {
  RILIEVO_RETURN_IF_ERROR(CheckStorePlace(*line));
  for (const auto& [name, seconds] :
       {std::pair("--max-job-seconds", line->max_job_seconds),
        std::pair("--max-idle-seconds", line->max_idle_seconds),
        std::pair("--drain-seconds", line->drain_seconds),
        std::pair("--keepalive-seconds", line->keepalive_seconds),
        std::pair("--keepalive-timeout-seconds", line->keepalive_timeout_seconds)}) {
    if (std::isfinite(seconds)) continue;
    return absl::InvalidArgumentError(
        absl::StrCat(name, " ", seconds, " is not a number of seconds; give for example 60"));
  }
  line->options.max_job_time = Milliseconds(line->max_job_seconds);
  line->options.max_idle_time = Milliseconds(line->max_idle_seconds);
  line->options.keep_time = Milliseconds(std::min(line->keep_days, 10'000.0) * 24 * 3600);
  line->options.drain_time = Milliseconds(line->drain_seconds);
  line->options.keepalive_time = Milliseconds(line->keepalive_seconds);
  line->options.keepalive_timeout = Milliseconds(line->keepalive_timeout_seconds);
  const bool anybody = line->options.tokens.empty() && line->options.tls_client_ca.empty();
  line->options.reflection = line->reflection == "on" || (line->reflection == "auto" && anybody);
  // Then the memory of jobs is the server's own.
  if (line->in_process) line->options.max_server_memory += line->options.MemoryBudget();
  return absl::OkStatus();
}

}  // namespace rilievo
