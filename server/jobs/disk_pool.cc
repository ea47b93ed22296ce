#include "server/jobs/disk_pool.h"

#include <utility>

namespace rilievo {

DiskPool::DiskPool(int threads) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { Work(); });
}

DiskPool::~DiskPool() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  wake_.notify_all();
  threads_.clear();
}

void DiskPool::Post(std::function<void()> task) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
    heart_.SetBusy(true);
  }
  wake_.notify_one();
}

void DiskPool::Work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return closing_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    std::function<void()> task = std::move(tasks_.front());
    tasks_.pop_front();
    ++working_;
    heart_.Beat();
    lock.unlock();
    task();
    task = nullptr;  // what it holds may be the last of something
    lock.lock();
    --working_;
    heart_.Beat();
    heart_.SetBusy(working_ > 0 || !tasks_.empty());
  }
}

}  // namespace rilievo
