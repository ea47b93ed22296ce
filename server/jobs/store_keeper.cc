#include "server/jobs/store_keeper.h"

#include <chrono>

namespace rilievo {
namespace {

constexpr std::chrono::seconds kPeriod{60};

int64_t NowMilliseconds() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace

StoreKeeper::StoreKeeper(JobStore* store, const Retention& retention)
    : store_(store), retention_(retention), stored_bytes_(Clean()) {
  thread_ = std::jthread([this](const std::stop_token& stop) { CleanUntil(stop); });
}

bool StoreKeeper::MakeRoomFor(int64_t bytes) {
  if (bytes > retention_.bytes) return false;
  if (stored_bytes_ + bytes > retention_.bytes) {
    Retention smaller = retention_;
    smaller.bytes -= bytes;
    const auto stored = store_->Clean(smaller, NowMilliseconds());
    if (!stored.ok()) return false;
    stored_bytes_ = *stored;
    if (*stored + bytes > retention_.bytes) return false;
  }
  stored_bytes_ += bytes;  // until the next cleaning counts what is there
  return true;
}

int64_t StoreKeeper::Clean() {
  const auto stored = store_->Clean(retention_, NowMilliseconds());
  return stored.ok() ? *stored : stored_bytes_.load();
}

void StoreKeeper::CleanUntil(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    wake_.wait_for(lock, stop, kPeriod, [] { return false; });
    if (!stop.stop_requested()) stored_bytes_ = Clean();
  }
}

}  // namespace rilievo
