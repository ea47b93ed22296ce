#include "client/library/retry.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <random>
#include <utility>

#include "absl/strings/match.h"
#include "client/library/status_conversion.h"

namespace rilievo {

bool IsWorthARetry(const absl::Status& status) {
  if (absl::IsUnavailable(status) || absl::IsCancelled(status)) return true;
  if (RetryDelay(status).has_value()) return true;
  // Not the server's own word, which has a reason: the transport had no memory for this stream.
  return absl::IsResourceExhausted(status) && absl::StrContains(status.message(), "RST_STREAM");
}

Retry::Retry(const RetryOptions& options, std::optional<Clock::time_point> deadline,
             std::stop_token stop)
    : options_(options), deadline_(deadline), stop_(std::move(stop)) {}

std::chrono::milliseconds Retry::Pause(const absl::Status& status) const {
  if (failures_ % options_.servers != 0) return std::chrono::milliseconds(0);
  const int doublings = std::min(failures_ / options_.servers - 1, 20);
  const auto longest =
      std::min<int64_t>(options_.longest_pause.count(), options_.first_pause.count() << doublings);
  // Clients that failed together do not come back together.
  thread_local std::minstd_rand random{std::random_device{}()};
  const std::chrono::milliseconds pause(std::uniform_int_distribution<int64_t>(
      (longest + 1) / 2, std::max<int64_t>(longest, 1))(random));
  return std::max(pause, RetryDelay(status).value_or(std::chrono::milliseconds(0)));
}

bool Retry::AfterFailure(const absl::Status& status) {
  if (stop_.stop_requested() || !IsWorthARetry(status)) return false;
  if (++failures_ >= options_.attempts * options_.servers) return false;
  const Clock::time_point until = Clock::now() + Pause(status);
  if (deadline_ && until >= *deadline_) return false;
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait_until(lock, stop_, until, [] { return false; });
  return !stop_.stop_requested();
}

}  // namespace rilievo
