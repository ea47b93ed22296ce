// The threads that compute, and how much work may wait for them.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

namespace rilievo {

// A fixed number of workers and of places. A place is taken before the points of a job are read,
// so that what waits, and its memory, is bounded; it is given back when the job's work is done.
class JobPool {
 public:
  // A taken place; gives it back when destroyed. Must not outlive the pool.
  class Ticket {
   public:
    explicit Ticket(JobPool* pool) : pool_(pool) {}
    Ticket(Ticket&& other) noexcept : pool_(other.pool_) { other.pool_ = nullptr; }
    Ticket& operator=(Ticket&& other) noexcept;
    ~Ticket();

   private:
    JobPool* pool_;
  };

  // `workers` >= 1; `waiting` >= 0 places beside those of the workers.
  JobPool(int workers, int waiting);

  // Waits for the work that runs; what has not started is dropped.
  ~JobPool();

  JobPool(const JobPool&) = delete;
  JobPool& operator=(const JobPool&) = delete;

  // Nothing when all places are taken. Never waits.
  std::optional<Ticket> TryAdmit();

  // Runs `work` on a worker, first come first served. The caller holds a ticket until the work is
  // done. `work` must not throw. Returns its number.
  uint64_t Submit(std::function<void()> work);

  // Takes back work that has not started; false when it has, or is done.
  bool Withdraw(uint64_t number);

  // How long to wait for a place: the work in hand at the mean time of the latest jobs, within 1 s
  // and 60 s.
  std::chrono::milliseconds RetryDelay() const;

  int admitted() const;
  int running() const;

 private:
  struct Entry {
    uint64_t number;
    std::function<void()> work;
  };

  void Release();
  void Work();

  const int workers_;
  const int places_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool closing_ = false;
  int admitted_ = 0;
  int running_ = 0;
  uint64_t next_number_ = 1;
  double mean_seconds_ = 1;  // exponential mean of a job's time
  std::deque<Entry> queue_;
  std::vector<std::jthread> threads_;
};

}  // namespace rilievo
