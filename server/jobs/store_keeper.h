// Keeps a store within its retention.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>

#include "server/store/job_store.h"

namespace rilievo {

// One thread of its own, which cleans once a minute.
class StoreKeeper {
 public:
  StoreKeeper(JobStore* store, const Retention& retention);

  // Whether `bytes` more may be stored; cleans when they may not yet. Waits for the disk. What was
  // granted counts as stored until the next cleaning.
  bool MakeRoomFor(int64_t bytes);

 private:
  int64_t Clean();
  void CleanUntil(const std::stop_token& stop);

  JobStore* const store_;
  const Retention retention_;
  std::atomic<int64_t> stored_bytes_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

}  // namespace rilievo
