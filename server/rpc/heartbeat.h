// Whether threads that have work still move.
#pragma once

#include <atomic>
#include <chrono>

namespace rilievo {

// Thread-safe, and never waits: who asks may not get stuck beside those it asks about.
class Heartbeat {
 public:
  using Clock = std::chrono::steady_clock;

  // They have moved.
  void Beat() { last_ = Clock::now().time_since_epoch().count(); }

  // Whether there is work for them. Work that comes to idle threads has its whole time.
  void SetBusy(bool busy) {
    if (busy && !busy_) Beat();
    busy_ = busy;
  }

  // For how long they have had work and not moved; 0 without work.
  Clock::duration SilentFor(Clock::time_point now) const {
    const Clock::time_point last{Clock::duration(last_)};
    return busy_ && now > last ? now - last : Clock::duration::zero();
  }

 private:
  std::atomic<bool> busy_ = false;
  std::atomic<Clock::rep> last_ = 0;
};

}  // namespace rilievo
