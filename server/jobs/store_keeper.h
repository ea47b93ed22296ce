// Keeps a store within its retention.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

#include "server/store/job_store.h"

namespace rilievo {

// One thread of its own, which cleans once a minute, and once a second looks for room while the
// disk is full and calls `each_second`.
class StoreKeeper {
 public:
  StoreKeeper(JobStore* store, std::function<void()> each_second);

 private:
  void KeepUntil(const std::stop_token& stop);

  JobStore* const store_;
  const std::function<void()> each_second_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

}  // namespace rilievo
