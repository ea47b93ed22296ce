#include "server/rpc/live_calls.h"

namespace rilievo {
namespace {

constexpr std::chrono::milliseconds kTickPeriod{100};

}  // namespace

LiveCalls::LiveCalls() : ticker_([this](const std::stop_token& stop) { TickUntil(stop); }) {}

LiveCalls::~LiveCalls() = default;

void LiveCalls::Enter(const std::shared_ptr<LiveCall>& call, const std::string& client) {
  const std::lock_guard lock(mutex_);
  calls_.emplace(call.get(), Entry{call, client});
  ++of_client_[client];
}

void LiveCalls::Leave(const LiveCall* call) {
  const std::lock_guard lock(mutex_);
  const auto found = calls_.find(call);
  if (found == calls_.end()) return;
  const auto count = of_client_.find(found->second.client);
  if (--count->second == 0) of_client_.erase(count);
  calls_.erase(found);
  // Under the lock: whoever waits may destroy this object as soon as the lock is free.
  changed_.notify_all();
}

void LiveCalls::StopAll(StopReason reason) {
  for (const auto& call : Snapshot()) call->Stop(reason);
}

bool LiveCalls::WaitUntilEmpty(std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, timeout, [this] { return calls_.empty(); });
}

int LiveCalls::size() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(calls_.size());
}

int LiveCalls::size(const std::string& client) const {
  const std::lock_guard lock(mutex_);
  const auto found = of_client_.find(client);
  return found == of_client_.end() ? 0 : found->second;
}

std::vector<std::shared_ptr<LiveCall>> LiveCalls::Snapshot() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<LiveCall>> alive;
  alive.reserve(calls_.size());
  for (const auto& [call, entry] : calls_) {
    if (auto strong = entry.call.lock()) alive.push_back(std::move(strong));
  }
  return alive;
}

void LiveCalls::TickUntil(const std::stop_token& stop) {
  heart_.SetBusy(true);
  while (!stop.stop_requested()) {
    heart_.Beat();
    for (const auto& call : Snapshot()) call->Tick(LiveCall::Clock::now());
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, stop, kTickPeriod, [] { return false; });
  }
}

}  // namespace rilievo
