// What the calls of JobsService share.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "server/jobs/disk_pool.h"
#include "server/jobs/fleet_member.h"
#include "server/jobs/job_board.h"
#include "server/jobs/store_keeper.h"
#include "server/rpc/client_places.h"
#include "server/rpc/service_core.h"
#include "server/store/job_store.h"

namespace rilievo {

// Two threads keep one slow sync from delaying all others.
inline constexpr int kDiskThreads = 2;
// What requests that wait for a disk thread may take, bytes as parsed; one takes the least at
// least.
inline constexpr int64_t kRequestBytes = 128 << 20, kLeastRequestBytes = 64 << 10;

// As the options say; what the store reports goes to the operator's log.
StoreSettings SettingsOfStore(const ServerOptions& options);

struct JobsCore {
  JobsCore(ServiceCore* service_core, std::unique_ptr<JobStore> job_store)
      : service(service_core),
        store(std::move(job_store)),
        board(service_core, store.get()),
        keeper(store.get(), [this] { EachSecond(); }),
        uploads(service_core->options.max_uploads),
        requests(kRequestBytes),
        bulk(kDiskThreads),
        disk(kDiskThreads) {
    if (store->shared()) {
      fleet.emplace(service, store.get(), &board, /*works=*/!service->options.serve_only);
    }
  }

  // A job that the store holds is to be worked on: here, or where somebody takes it.
  void Begin(StoredJob stored);

  // Tells whether the store has room, from now on and each second; {} ends it.
  void WatchRoom(std::function<void(bool room)> tell);
  void EachSecond();

  ServiceCore* const service;
  const std::unique_ptr<JobStore> store;
  JobBoard board;
  std::optional<FleetMember> fleet;  // of a shared store
  std::mutex room_mutex;
  std::function<void(bool)> tell_room;
  StoreKeeper keeper;
  ClientPlaces uploads;   // of streams under way
  ClientPlaces requests;  // bytes of those that wait
  DiskPool bulk;          // bytes of scans and surfaces
  DiskPool disk;          // all else, which is little. First to end, as bulk: they use all others
};

}  // namespace rilievo
