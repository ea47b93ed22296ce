// What the calls of one server share.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "server/auth/doorkeeper.h"
#include "server/conversion/call_error.h"
#include "server/conversion/server_options.h"
#include "server/observability/job_log.h"
#include "server/observability/server_metrics.h"
#include "server/rpc/job_pool.h"
#include "server/rpc/live_calls.h"
#include "server/rpc/machine_health.h"
#include "server/worker/job_work.h"

namespace rilievo {

struct ServiceCore {
  ServiceCore(const ServerOptions& server_options, JobWork job_work, JobLog job_log,
              std::unique_ptr<const Doorkeeper> doorkeeper);

  // As the doorkeeper's Admit(); then RESOURCE_EXHAUSTED, CALLS_LIMIT, when as many streams are
  // under way as the server takes, or as it takes of this client (MayTakePlace()).
  std::optional<CallError> AdmitStream(const grpc::CallbackServerContext& context,
                                       Caller* caller) const;

  // A job, or an attempt at a kept one, has ended: counts it and logs it.
  void Report(const JobRecord& record) const;

  const ServerOptions options;
  // As given; where the machine cannot work, the pool rests before the next job.
  const JobWork work;
  const JobLog log;
  const std::unique_ptr<const Doorkeeper> door;
  const std::shared_ptr<ServerMetrics> metrics = std::make_shared<ServerMetrics>();
  std::atomic<uint64_t> next_job{1};
  std::atomic<int64_t> upload_bytes{0};  // points of calls of Reconstruct, in memory
  std::atomic<bool> draining{false};     // no new jobs
  MachineHealth machine;
  LiveCalls live_calls;  // outlives the pool, whose work may be the last to leave
  JobPool pool;
};

}  // namespace rilievo
