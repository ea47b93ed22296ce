// What Prometheus is told of a server.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "grpcpp/support/server_interceptor.h"
#include "server/observability/job_log.h"

namespace prometheus {
class Collectable;
}

namespace rilievo {

// As of one moment.
struct ServerState {
  int queued = 0, running = 0;     // jobs
  double oldest_wait_seconds = 0;  // of those queued
  int streams = 0;                 // calls and kept jobs under way
  int64_t foreign_requests = 0;    // so far, for a job of another owner
  int connections = 0;             // that are open
};

// All servers and workers that share a store, as of one moment.
struct FleetState {
  int64_t queued = 0, running = 0;  // kept jobs
  int64_t workers = 0;              // processes that take jobs
};

// Thread-safe. Counts from the start of the server; names begin with "rilievo_".
class ServerMetrics {
 public:
  ServerMetrics();
  ~ServerMetrics();

  // A call of Reconstruct: jobs_ended_total{kind="call", status}, stage_seconds{stage},
  // job_seconds{kind}.
  void CountJob(const JobRecord& record);

  // One attempt at a kept job: attempts_ended_total{status}, and the times of CountJob().
  void CountAttempt(const JobRecord& record);

  // A kept job that is finished, however many attempts it took: jobs_ended_total{kind="kept",
  // status}.
  void CountKeptJob(absl::StatusCode code);

  // connections_refused_total{reason}.
  void CountRefusedConnection(const std::string& reason);

  // Of a fleet: fleet_jobs{state}, fleet_workers, and store_up, which is 0 without a state.
  void SetFleet(const std::optional<FleetState>& state);
  // leases_lost_total: jobs of workers that were silent for too long, which this process freed.
  void CountLostLeases(int64_t jobs);
  // results_dropped_total: jobs that were worked on here and that another worker had taken.
  void CountDroppedResult();

  // Of scans, received_bytes_total; of surfaces, sent_bytes_total.
  void CountReceived(int64_t bytes);
  void CountSent(int64_t bytes);

  // An ended RPC: calls_total{method, code}; refusals_total{reason} when its error gives one.
  void CountCall(const std::string& method, const grpc::Status& status);

  // `state` is asked at each collection, until this object is gone or the next call, {} for none:
  // jobs{state}, queue_oldest_seconds, streams, connections, and
  // refusals_total{reason="OTHER_OWNER"}. Not while a collection holds what `state` needs.
  void Watch(std::function<ServerState()> state);

  // All of it, and process_resident_memory_bytes; for a MetricsPort or a test.
  std::shared_ptr<prometheus::Collectable> collectable() const;

  // In Prometheus' text format.
  std::string Text() const;

 private:
  struct Registers;

  const std::shared_ptr<Registers> registers_;
};

// Counts every RPC of a server by the status it ends with.
std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> CallCounter(
    std::shared_ptr<ServerMetrics> metrics);

}  // namespace rilievo
