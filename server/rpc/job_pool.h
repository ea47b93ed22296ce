// The threads that compute, and how much work may wait for them.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <list>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "server/rpc/client_places.h"
#include "server/rpc/heartbeat.h"

namespace rilievo {

// A fixed number of workers and of places. A place is taken before the points of a job are read,
// so that what waits, and its memory, is bounded; it is given back when the job's work is done.
class JobPool {
 public:
  // A taken place; gives it back when destroyed. Must not outlive the pool.
  class Ticket {
   public:
    Ticket(JobPool* pool, std::string client) : pool_(pool), client_(std::move(client)) {}
    Ticket(Ticket&& other) noexcept : pool_(other.pool_), client_(std::move(other.client_)) {
      other.pool_ = nullptr;
    }
    Ticket& operator=(Ticket&& other) noexcept;
    ~Ticket();

   private:
    JobPool* pool_;
    std::string client_;
  };

  // Memory that a scan on its way in, or a surface on its way out, takes of what jobs may need;
  // given back when destroyed. Must not outlive the pool.
  class Charge {
   public:
    Charge(JobPool* pool, int64_t bytes) : pool_(pool), bytes_(bytes) {}
    Charge(Charge&& other) noexcept : pool_(other.pool_), bytes_(std::exchange(other.bytes_, 0)) {}
    Charge& operator=(Charge&& other) noexcept;
    ~Charge();

    // What it takes from now on.
    void Set(int64_t bytes);

   private:
    JobPool* pool_;
    int64_t bytes_;
  };

  // What a job brings into the queue.
  struct Demand {
    std::string client;  // clients take turns; the jobs of one are done in their order
    int64_t memory = 0;  // bytes, by estimate
    bool last = false;   // runs when nothing else waits or runs, and nothing beside it
  };

  // `workers` >= 1; `waiting` >= 0 places beside those of the workers. `memory`: bytes that the
  // running jobs may need together; a job that needs more runs alone.
  JobPool(int workers, int waiting, int64_t memory = std::numeric_limits<int64_t>::max());

  // Waits for the work that runs; what has not started is dropped.
  ~JobPool();

  JobPool(const JobPool&) = delete;
  JobPool& operator=(const JobPool&) = delete;

  // Nothing when all places are taken, or as many as a client gets (MayTakePlace()). Never waits.
  std::optional<Ticket> TryAdmit(const std::string& client = "");

  // Nothing when all charges together would be more than the memory of the running jobs may be. The
  // only one is always granted. Never waits.
  std::optional<Charge> TryCharge(int64_t bytes);

  // Runs `work` on a worker when its client's turn has come and there is memory for it; nobody
  // overtakes a job that waits for memory. `work` must not throw. Returns its number.
  uint64_t Submit(std::function<void()> work) { return Submit(std::move(work), {}); }
  uint64_t Submit(std::function<void()> work, const Demand& demand);

  // Takes back work that has not started; false when it has, or is done.
  bool Withdraw(uint64_t number);

  // No work begins for that long from now on; 0: at once again. The latest word counts.
  void Hold(std::chrono::milliseconds time);

  // How many jobs more would begin at once, memory left aside; 0 while no work begins.
  int FreePlaces() const;

  // `tell` is called, with the pool locked, whenever there may be more of them; {} ends that.
  void WhenFree(std::function<void()> tell);

  // How long to wait for a place: the work in hand at the mean time of the latest jobs, within 1 s
  // and 60 s.
  std::chrono::milliseconds RetryDelay() const;

  // Of the work in hand.
  struct State {
    int running = 0, waiting = 0;
    std::chrono::duration<double> oldest_wait{0};  // of what waits; 0 when nothing does
  };
  State state() const;

  // Of the threads: they have work while a job could start and one of them is free.
  const Heartbeat& heart() const { return heart_; }

  int admitted() const;
  int running() const;

 private:
  struct Entry {
    uint64_t number;
    std::function<void()> work;
    int64_t memory;
    std::chrono::steady_clock::time_point since;
  };
  // The jobs of a client that wait; never empty.
  struct Line {
    std::string client;
    std::deque<Entry> entries;
  };

  void Release(const std::string& client);
  void ChangeCharged(int64_t by);
  void Work();

  // With mutex_ held.
  static bool WithdrawFrom(Line* line, uint64_t number, Entry* withdrawn);
  bool HasRoomForNext() const;
  void TellHeart() { heart_.SetBusy(running_ < workers_ && HasRoomForNext()); }
  Entry TakeNext();

  const int workers_;
  const int64_t memory_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool closing_ = false;
  std::chrono::steady_clock::time_point held_until_{};
  ClientPlaces admissions_;
  int running_ = 0;
  uint64_t next_number_ = 1;
  double mean_seconds_ = 1;    // exponential mean of a job's time
  int64_t memory_in_use_ = 0;  // by running jobs
  int64_t charged_ = 0;
  std::list<Line> lines_;  // the first one is next
  Line last_;              // when there are no lines
  std::function<void()> when_free_;
  Heartbeat heart_;
  std::vector<std::jthread> threads_;
};

}  // namespace rilievo
