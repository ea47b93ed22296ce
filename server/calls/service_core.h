// What the calls of one server share.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

#include "server/calls/job_log.h"
#include "server/calls/job_pool.h"
#include "server/calls/live_calls.h"
#include "server/conversion/server_options.h"
#include "server/worker/job_work.h"

namespace rilievo {

struct ServiceCore {
  ServiceCore(const ServerOptions& server_options, JobWork job_work, JobLog job_log)
      : options(server_options),
        work(std::move(job_work)),
        log(std::move(job_log)),
        pool(server_options.max_concurrent_jobs, server_options.max_queued_jobs,
             server_options.MemoryBudget()) {}

  const ServerOptions options;
  const JobWork work;
  const JobLog log;
  std::atomic<uint64_t> next_job{1};
  std::atomic<bool> draining{false};  // no new jobs
  LiveCalls live_calls;               // outlives the pool, whose work may be the last to leave
  JobPool pool;
};

}  // namespace rilievo
