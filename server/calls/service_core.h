// What the calls of one server share.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>

#include "server/calls/job_log.h"
#include "server/calls/job_pool.h"
#include "server/calls/live_calls.h"
#include "server/conversion/server_options.h"
#include "server/doors/doorkeeper.h"
#include "server/worker/job_work.h"

namespace rilievo {

struct ServiceCore {
  ServiceCore(const ServerOptions& server_options, JobWork job_work, JobLog job_log,
              std::unique_ptr<const Doorkeeper> doorkeeper)
      : options(server_options),
        work(std::move(job_work)),
        log(std::move(job_log)),
        door(std::move(doorkeeper)),
        pool(server_options.max_concurrent_jobs, server_options.max_queued_jobs,
             server_options.MemoryBudget()) {}

  const ServerOptions options;
  const JobWork work;
  const JobLog log;
  const std::unique_ptr<const Doorkeeper> door;
  std::atomic<uint64_t> next_job{1};
  std::atomic<bool> draining{false};  // no new jobs
  LiveCalls live_calls;               // outlives the pool, whose work may be the last to leave
  JobPool pool;
};

}  // namespace rilievo
