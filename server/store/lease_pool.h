// A few of a kind, such as connections, for many threads.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace rilievo {

// Thread-safe. Of one alone it is a lock.
template <typename Thing>
class LeasePool {
 public:
  // At least one.
  explicit LeasePool(std::vector<std::unique_ptr<Thing>> things) : free_(std::move(things)) {}

  class Lease {
   public:
    explicit Lease(LeasePool* pool) : pool_(pool), thing_(pool->TakeFree()) {}
    ~Lease() { pool_->GiveBack(std::move(thing_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;

    Thing* operator->() const { return thing_.get(); }
    Thing* get() const { return thing_.get(); }

   private:
    LeasePool* const pool_;
    std::unique_ptr<Thing> thing_;
  };

  // Waits until one is free. A thread holds one at a time.
  Lease Take() { return Lease(this); }

 private:
  std::unique_ptr<Thing> TakeFree() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !free_.empty(); });
    std::unique_ptr<Thing> taken = std::move(free_.back());
    free_.pop_back();
    return taken;
  }

  void GiveBack(std::unique_ptr<Thing> thing) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(thing));
    changed_.notify_one();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::unique_ptr<Thing>> free_;
};

}  // namespace rilievo
