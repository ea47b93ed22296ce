#include "server/jobs/jobs_core.h"

#include <utility>

#include "server/observability/server_log.h"

namespace rilievo {

StoreSettings SettingsOfStore(const ServerOptions& options) {
  return {.retention = {.age_ms = options.keep_time.count(),
                        .bytes = options.keep_bytes,
                        .owner_bytes = options.OwnerBytes()},
          .scratch = options.scratch,
          .report = [](const std::string& line) { LogMessage("store: " + line); }};
}

void JobsCore::Begin(StoredJob stored) {
  if (fleet) {
    fleet->Wake();
  } else {
    board.Add(std::move(stored));
  }
}

void JobsCore::WatchRoom(std::function<void(bool room)> tell) {
  const std::lock_guard lock(room_mutex);
  tell_room = std::move(tell);
}

void JobsCore::EachSecond() {
  board.KeepResults();
  const std::lock_guard lock(room_mutex);
  if (tell_room) tell_room(!store->full());
}

}  // namespace rilievo
