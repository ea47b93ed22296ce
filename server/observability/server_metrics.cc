#include "server/observability/server_metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <mutex>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/match.h"
#include "server/observability/error_reason.h"
#include "server/observability/server_log.h"
#include "server/os/process_usage.h"

namespace rilievo {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Gauge;
using prometheus::Histogram;

// Of a stage or a job: a thousandth to ten minutes.
const Histogram::BucketBoundaries& Buckets() {
  static const Histogram::BucketBoundaries buckets = {0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1,
                                                      3,     10,    30,   60,   180, 600};
  return buckets;
}

}  // namespace

struct ServerMetrics::Registers final : prometheus::Collectable {
  // Prometheus does not see the rise of a counter that was not there.
  Registers() {
    for (const char* limit : {"ALL", "ADDRESS", "HANDLES", "MEMORY"}) {
      connections_refused.Add({{"reason", limit}});
    }
  }

  prometheus::Registry registry;
  Family<Counter>& jobs_ended = prometheus::BuildCounter()
                                    .Name("rilievo_jobs_ended_total")
                                    .Help("Jobs that ended, by kind and status")
                                    .Register(registry);
  Family<Counter>& attempts_ended =
      prometheus::BuildCounter()
          .Name("rilievo_attempts_ended_total")
          .Help("Attempts at kept jobs that ended, by status; ABORTED: the worker was killed")
          .Register(registry);
  Family<Counter>& calls = prometheus::BuildCounter()
                               .Name("rilievo_calls_total")
                               .Help("RPCs that ended, by method and status code")
                               .Register(registry);
  Family<Counter>& refusals = prometheus::BuildCounter()
                                  .Name("rilievo_refusals_total")
                                  .Help("RPCs that ended with an error, by its reason")
                                  .Register(registry);
  Family<Histogram>& stage_seconds = prometheus::BuildHistogram()
                                         .Name("rilievo_stage_seconds")
                                         .Help("Time in each stage of the jobs that succeeded")
                                         .Register(registry);
  Family<Histogram>& job_seconds = prometheus::BuildHistogram()
                                       .Name("rilievo_job_seconds")
                                       .Help("Time of work of each job")
                                       .Register(registry);
  Family<Gauge>& jobs = prometheus::BuildGauge()
                            .Name("rilievo_jobs")
                            .Help("Jobs that wait and jobs that are worked on")
                            .Register(registry);
  Gauge& queued = jobs.Add({{"state", "queued"}});
  Gauge& running = jobs.Add({{"state", "running"}});
  Gauge& oldest = prometheus::BuildGauge()
                      .Name("rilievo_queue_oldest_seconds")
                      .Help("How long the oldest job in the queue has waited")
                      .Register(registry)
                      .Add({});
  Gauge& streams = prometheus::BuildGauge()
                       .Name("rilievo_streams")
                       .Help("Streams and kept jobs under way")
                       .Register(registry)
                       .Add({});
  Gauge& connections = prometheus::BuildGauge()
                           .Name("rilievo_connections")
                           .Help("Connections that are open")
                           .Register(registry)
                           .Add({});
  Family<Counter>& connections_refused =
      prometheus::BuildCounter()
          .Name("rilievo_connections_refused_total")
          .Help("Connections that were closed, by the limit that they met")
          .Register(registry);
  Gauge& resident = prometheus::BuildGauge()
                        .Name("process_resident_memory_bytes")
                        .Help("Memory of the server itself, without its workers")
                        .Register(registry)
                        .Add({});
  Counter& received = prometheus::BuildCounter()
                          .Name("rilievo_received_bytes_total")
                          .Help("Bytes of scans that arrived")
                          .Register(registry)
                          .Add({});
  Counter& sent = prometheus::BuildCounter()
                      .Name("rilievo_sent_bytes_total")
                      .Help("Bytes of surfaces that were sent")
                      .Register(registry)
                      .Add({});
  Family<Gauge>& fleet_jobs = prometheus::BuildGauge()
                                  .Name("rilievo_fleet_jobs")
                                  .Help("Kept jobs of all servers that share the store, by state")
                                  .Register(registry);
  Gauge& fleet_queued = fleet_jobs.Add({{"state", "queued"}});
  Gauge& fleet_running = fleet_jobs.Add({{"state", "running"}});
  Gauge& fleet_workers = prometheus::BuildGauge()
                             .Name("rilievo_fleet_workers")
                             .Help("Processes that take jobs of the shared store")
                             .Register(registry)
                             .Add({});
  Gauge& store_up =
      prometheus::BuildGauge()
          .Name("rilievo_store_up")
          .Help("1 while the shared store can be reached; always, where there is none")
          .Register(registry)
          .Add({}, 1);
  Counter& leases_lost =
      prometheus::BuildCounter()
          .Name("rilievo_leases_lost_total")
          .Help("Jobs of workers that were silent for too long, which this process freed")
          .Register(registry)
          .Add({});
  Counter& results_dropped =
      prometheus::BuildCounter()
          .Name("rilievo_results_dropped_total")
          .Help("Jobs worked on here that another worker had taken meanwhile")
          .Register(registry)
          .Add({});
  Counter& log_lines_dropped =
      prometheus::BuildCounter()
          .Name("rilievo_log_lines_dropped_total")
          .Help("Lines of the log that were left out, since nobody read it")
          .Register(registry)
          .Add({});
  Counter& other_owner = refusals.Add({{"reason", "OTHER_OWNER"}});

  void CountTimes(const char* kind, const JobRecord& record);

  mutable std::mutex mutex;  // of what follows
  std::function<ServerState()> state;

  std::vector<prometheus::MetricFamily> Collect() const override {
    const std::lock_guard lock(mutex);
    resident.Set(static_cast<double>(ResidentBytes()));
    log_lines_dropped.Increment(static_cast<double>(DroppedLogLines()) - log_lines_dropped.Value());
    if (state) {
      const ServerState now = state();
      queued.Set(now.queued);
      running.Set(now.running);
      oldest.Set(now.oldest_wait_seconds);
      streams.Set(now.streams);
      connections.Set(now.connections);
      other_owner.Increment(static_cast<double>(now.foreign_requests) - other_owner.Value());
    }
    return registry.Collect();
  }
};

ServerMetrics::ServerMetrics() : registers_(std::make_shared<Registers>()) {}

ServerMetrics::~ServerMetrics() { Watch({}); }

void ServerMetrics::Watch(std::function<ServerState()> state) {
  const std::lock_guard lock(registers_->mutex);
  registers_->state = std::move(state);
}

void ServerMetrics::Registers::CountTimes(const char* kind, const JobRecord& record) {
  if (record.work_seconds > 0) {
    job_seconds.Add({{"kind", kind}}, Buckets()).Observe(record.work_seconds);
  }
  for (const auto& [stage, seconds] : record.stage_seconds) {
    stage_seconds.Add({{"stage", stage}}, Buckets()).Observe(seconds);
  }
}

void ServerMetrics::CountJob(const JobRecord& record) {
  registers_->jobs_ended.Add({{"kind", "call"}, {"status", absl::StatusCodeToString(record.code)}})
      .Increment();
  registers_->CountTimes("call", record);
}

void ServerMetrics::CountAttempt(const JobRecord& record) {
  registers_->attempts_ended.Add({{"status", absl::StatusCodeToString(record.code)}}).Increment();
  registers_->CountTimes("kept", record);
}

void ServerMetrics::CountKeptJob(absl::StatusCode code) {
  registers_->jobs_ended.Add({{"kind", "kept"}, {"status", absl::StatusCodeToString(code)}})
      .Increment();
}

void ServerMetrics::CountRefusedConnection(const std::string& reason) {
  registers_->connections_refused.Add({{"reason", reason}}).Increment();
}

void ServerMetrics::SetFleet(const std::optional<FleetState>& state) {
  registers_->store_up.Set(state ? 1 : 0);
  if (!state) return;
  registers_->fleet_queued.Set(static_cast<double>(state->queued));
  registers_->fleet_running.Set(static_cast<double>(state->running));
  registers_->fleet_workers.Set(static_cast<double>(state->workers));
}

void ServerMetrics::CountLostLeases(int64_t jobs) {
  registers_->leases_lost.Increment(static_cast<double>(jobs));
}

void ServerMetrics::CountDroppedResult() { registers_->results_dropped.Increment(); }

void ServerMetrics::CountReceived(int64_t bytes) {
  registers_->received.Increment(static_cast<double>(bytes));
}

void ServerMetrics::CountSent(int64_t bytes) {
  registers_->sent.Increment(static_cast<double>(bytes));
}

void ServerMetrics::CountCall(const std::string& method, const grpc::Status& status) {
  const auto code = static_cast<absl::StatusCode>(status.error_code());
  // Names of clients' own making would grow the register without end.
  const bool ours =
      status.error_code() != grpc::StatusCode::UNIMPLEMENTED &&
      (absl::StartsWith(method, "/rilievo.v1.") || absl::StartsWith(method, "/grpc."));
  registers_->calls
      .Add({{"method", ours ? method : "other"}, {"code", absl::StatusCodeToString(code)}})
      .Increment();
  if (status.ok()) return;
  if (const std::string reason = ErrorReasonOf(status); !reason.empty()) {
    registers_->refusals.Add({{"reason", reason}}).Increment();
  }
}

std::shared_ptr<prometheus::Collectable> ServerMetrics::collectable() const { return registers_; }

std::string ServerMetrics::Text() const {
  return prometheus::TextSerializer().Serialize(registers_->Collect());
}

namespace {

class CountOneCall final : public grpc::experimental::Interceptor {
 public:
  CountOneCall(std::string method, std::shared_ptr<ServerMetrics> metrics)
      : method_(std::move(method)), metrics_(std::move(metrics)) {}

  void Intercept(grpc::experimental::InterceptorBatchMethods* methods) override {
    if (methods->QueryInterceptionHookPoint(
            grpc::experimental::InterceptionHookPoints::PRE_SEND_STATUS)) {
      metrics_->CountCall(method_, methods->GetSendStatus());
    }
    methods->Proceed();
  }

 private:
  const std::string method_;
  const std::shared_ptr<ServerMetrics> metrics_;
};

class CountCalls final : public grpc::experimental::ServerInterceptorFactoryInterface {
 public:
  explicit CountCalls(std::shared_ptr<ServerMetrics> metrics) : metrics_(std::move(metrics)) {}

  grpc::experimental::Interceptor* CreateServerInterceptor(
      grpc::experimental::ServerRpcInfo* call) override {
    return new CountOneCall(call->method() == nullptr ? "" : call->method(), metrics_);
  }

 private:
  const std::shared_ptr<ServerMetrics> metrics_;
};

}  // namespace

std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface> CallCounter(
    std::shared_ptr<ServerMetrics> metrics) {
  return std::make_unique<CountCalls>(std::move(metrics));
}

}  // namespace rilievo
