#include "server/observability/line_rate.h"

#include <utility>

namespace rilievo {

std::optional<uint64_t> LineRate::Pass(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (now - second_ >= std::chrono::seconds(1)) {
    second_ = now;
    passed_ = 0;
  }
  if (passed_ >= most_) {
    ++left_out_;
    return std::nullopt;
  }
  ++passed_;
  return std::exchange(left_out_, 0);
}

}  // namespace rilievo
