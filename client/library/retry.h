// Calls that may be repeated, repeated after growing pauses.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <stop_token>

#include "absl/status/status.h"

namespace rilievo {

struct RetryOptions {
  int attempts = 8;                                 // in a row without progress; 1: no retry. >= 1
  std::chrono::milliseconds first_pause{200};       // doubled each time, spread by a half, > 0
  std::chrono::milliseconds longest_pause{10'000};  // unless the server asks for more
  // That are tried in turn: `attempts` is of each, and only when all have failed there is a pause.
  int servers = 1;
};

// Whether the same call may succeed later: the server is away, ended before it had answered
// (CANCELLED, where the caller did not ask to stop), named a time to retry, or had no memory left
// for bytes on their way.
bool IsWorthARetry(const absl::Status& status);

// Decides when to call again, and waits.
class Retry {
 public:
  using Clock = std::chrono::steady_clock;

  // `deadline`: of all attempts together.
  Retry(const RetryOptions& options, std::optional<Clock::time_point> deadline,
        std::stop_token stop);

  // Something has been achieved: pauses and attempts begin anew.
  void Progress() { failures_ = 0; }

  // Waits, then true; false when `status` is not a reason to try again, or no attempt or no time is
  // left, or a stop was requested.
  bool AfterFailure(const absl::Status& status);

 private:
  std::chrono::milliseconds Pause(const absl::Status& status) const;

  const RetryOptions options_;
  const std::optional<Clock::time_point> deadline_;
  const std::stop_token stop_;
  int failures_ = 0;
};

}  // namespace rilievo
