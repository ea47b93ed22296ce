// What the calls of one server share.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

#include "server/job_log.h"
#include "server/job_pool.h"
#include "server/live_calls.h"
#include "server/reconstruct_function.h"
#include "server/server_options.h"

namespace rilievo {

struct ServiceCore {
  ServiceCore(const ServerOptions& server_options, ReconstructFunction function, JobLog job_log)
      : options(server_options),
        reconstruct(std::move(function)),
        log(std::move(job_log)),
        pool(server_options.max_concurrent_jobs, server_options.max_queued_jobs) {}

  const ServerOptions options;
  const ReconstructFunction reconstruct;
  const JobLog log;
  std::atomic<uint64_t> next_job{1};
  std::atomic<bool> draining{false};  // no new jobs
  LiveCalls live_calls;               // outlives the pool, whose work may be the last to leave
  JobPool pool;
};

}  // namespace rilievo
