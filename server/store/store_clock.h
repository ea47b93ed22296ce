// The time by which a store grows old.
#pragma once

#include <cstdint>
#include <functional>

namespace rilievo {

// Milliseconds that pass as a server's monotonic clock does. They begin as the wall clock reads
// when the store is made, and no step of it moves them. While no server runs they pass as the wall
// clock does, but by a day at most: a clock that was set in between makes nothing older than that.
class StoreClock {
 public:
  struct Source {
    std::function<int64_t()> wall_ms;    // since 1970; may step
    std::function<int64_t()> steady_ms;  // since whenever; never steps
  };
  static Source System();

  // Goes on from what an earlier one read last, and the wall clock then; 0 and 0 for a new store.
  StoreClock(int64_t store_ms, int64_t wall_ms, Source source);

  int64_t Now() const { return begin_ms_ + source_.steady_ms() - steady_begin_ms_; }
  int64_t Wall() const { return source_.wall_ms(); }

 private:
  const Source source_;
  const int64_t steady_begin_ms_;
  const int64_t begin_ms_;
};

}  // namespace rilievo
