// The threads that wait for the disk, so that gRPC's never do.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "server/rpc/heartbeat.h"

namespace rilievo {

class DiskPool {
 public:
  explicit DiskPool(int threads);

  // What was posted is done first.
  ~DiskPool();

  DiskPool(const DiskPool&) = delete;
  DiskPool& operator=(const DiskPool&) = delete;

  // First come, first served, on any of the threads.
  void Post(std::function<void()> task);

  // Of a task that takes long and gets on.
  void Moved() { heart_.Beat(); }

  const Heartbeat& heart() const { return heart_; }

 private:
  void Work();

  std::mutex mutex_;
  std::condition_variable wake_;
  bool closing_ = false;
  int working_ = 0;
  Heartbeat heart_;
  std::deque<std::function<void()>> tasks_;
  std::vector<std::jthread> threads_;
};

}  // namespace rilievo
