#include "server/store/store_clock.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace rilievo {
namespace {

constexpr int64_t kLongestPauseMs = 24 * 3600 * int64_t{1000};

template <typename Clock>
int64_t Milliseconds() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(Clock::now().time_since_epoch())
      .count();
}

}  // namespace

StoreClock::Source StoreClock::System() {
  return {Milliseconds<std::chrono::system_clock>, Milliseconds<std::chrono::steady_clock>};
}

StoreClock::StoreClock(int64_t store_ms, int64_t wall_ms, Source source)
    : source_(std::move(source)),
      steady_begin_ms_(source_.steady_ms()),
      begin_ms_(store_ms == 0 ? source_.wall_ms()
                              : store_ms + std::clamp<int64_t>(source_.wall_ms() - wall_ms, 0,
                                                               kLongestPauseMs)) {}

}  // namespace rilievo
