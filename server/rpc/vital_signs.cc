#include "server/rpc/vital_signs.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "server/observability/server_log.h"

namespace rilievo {
namespace {

constexpr std::chrono::milliseconds kLongestPeriod{500};

}  // namespace

VitalSigns::VitalSigns(std::vector<std::pair<std::string, const Heartbeat*>> hearts,
                       std::chrono::milliseconds most, std::function<void(bool)> changed)
    : hearts_(std::move(hearts)),
      most_(most),
      changed_(std::move(changed)),
      thread_([this](const std::stop_token& stop) { WatchUntil(stop); }) {}

VitalSigns::~VitalSigns() = default;

std::string VitalSigns::Silent() const {
  const auto now = Heartbeat::Clock::now();
  for (const auto& [name, heart] : hearts_) {
    if (heart->SilentFor(now) >= most_) return name;
  }
  return "";
}

void VitalSigns::WatchUntil(const std::stop_token& stop) {
  const auto period = std::clamp(most_ / 4, std::chrono::milliseconds(1), kLongestPeriod);
  bool alive = true;
  while (!stop.stop_requested()) {
    const std::string silent = Silent();
    if (silent.empty() != alive) {
      alive = silent.empty();
      LogMessage(alive ? "all threads move again: health is SERVING"
                       : absl::StrCat(silent, " has work and has not moved for ", most_.count(),
                                      " ms: health is NOT_SERVING"));
      changed_(alive);
    }
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, stop, period, [] { return false; });
  }
}

}  // namespace rilievo
