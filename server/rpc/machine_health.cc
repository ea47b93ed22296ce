#include "server/rpc/machine_health.h"

#include <algorithm>
#include <utility>

namespace rilievo {
namespace {

constexpr int kUnable = 3;  // failures in a row
constexpr std::chrono::milliseconds kFirstPause{100}, kLongestPause{5000};
constexpr int kPauseGrowth = 5;

}  // namespace

std::optional<std::chrono::milliseconds> MachineHealth::Judge(const absl::Status& status) {
  if (absl::IsCancelled(status)) return std::nullopt;
  const std::lock_guard lock(mutex_);
  const bool was_able = failures_ < kUnable;
  failures_ = absl::IsUnavailable(status) ? failures_ + 1 : 0;
  const bool able = failures_ < kUnable;
  if (able != was_able && on_change_) on_change_(able);
  if (failures_ == 0) return std::chrono::milliseconds(0);
  std::chrono::milliseconds pause = kFirstPause;
  for (int i = 1; i < failures_ && pause < kLongestPause; ++i) pause *= kPauseGrowth;
  return std::min(pause, kLongestPause);
}

void MachineHealth::Watch(std::function<void(bool able)> on_change) {
  const std::lock_guard lock(mutex_);
  on_change_ = std::move(on_change);
}

}  // namespace rilievo
