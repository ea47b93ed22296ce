// What the calls of JobsService share.
#pragma once

#include <memory>
#include <optional>

#include "server/jobs/disk_pool.h"
#include "server/jobs/job_board.h"
#include "server/jobs/store_keeper.h"
#include "server/rpc/client_places.h"
#include "server/rpc/service_core.h"
#include "server/store/job_store.h"

namespace rilievo {

// What waits for the disk is little: two threads keep one slow sync from delaying all others.
inline constexpr int kDiskThreads = 2;

struct JobsCore {
  JobsCore(ServiceCore* service_core, std::unique_ptr<JobStore> job_store)
      : service(service_core),
        store(std::move(job_store)),
        keeper(store.get(), {.age_ms = service_core->options.keep_time.count(),
                             .bytes = service_core->options.keep_bytes}),
        board(service_core, store.get()),
        uploads(service_core->options.max_uploads),
        disk(kDiskThreads) {}

  ServiceCore* const service;
  const std::unique_ptr<JobStore> store;
  StoreKeeper keeper;
  JobBoard board;
  ClientPlaces uploads;  // of streams under way
  DiskPool disk;         // first to end: its tasks use all others
};

}  // namespace rilievo
