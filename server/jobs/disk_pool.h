// The threads that wait for the disk, so that gRPC's never do.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace rilievo {

class DiskPool {
 public:
  explicit DiskPool(int threads);

  // What was posted is done first.
  ~DiskPool();

  DiskPool(const DiskPool&) = delete;
  DiskPool& operator=(const DiskPool&) = delete;

  // First come, first served, on any of the threads. `task` must not throw.
  void Post(std::function<void()> task);

 private:
  void Work();

  std::mutex mutex_;
  std::condition_variable wake_;
  bool closing_ = false;
  std::deque<std::function<void()>> tasks_;
  std::vector<std::jthread> threads_;
};

}  // namespace rilievo
