#include "server/jobs/store_keeper.h"

#include <chrono>
#include <utility>

#include "server/observability/server_log.h"

namespace rilievo {
namespace {

constexpr std::chrono::seconds kPeriod{1};
constexpr int kPeriodsOfCleaning = 60;

}  // namespace

StoreKeeper::StoreKeeper(JobStore* store, std::function<void()> each_second)
    : store_(store), each_second_(std::move(each_second)) {
  thread_ = std::jthread([this](const std::stop_token& stop) { KeepUntil(stop); });
}

void StoreKeeper::KeepUntil(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  for (int period = 0; !stop.stop_requested(); ++period) {
    if (store_->full()) store_->LookForRoom();
    each_second_();
    if (period % kPeriodsOfCleaning == 0) {
      const auto cleaned = store_->Clean();
      if (!cleaned.ok()) LogMessage("store: " + cleaned.status().ToString());
    }
    wake_.wait_for(lock, stop, kPeriod, [] { return false; });
  }
}

}  // namespace rilievo
