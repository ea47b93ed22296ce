#include "server/auth/connection_watch.h"

#include <algorithm>
#include <optional>

#include "core/base/freed_memory.h"
#include "server/observability/line_rate.h"
#include "server/observability/server_log.h"
#include "server/os/process_usage.h"

namespace rilievo {
namespace {

// Less than this is not worth a question.
constexpr int64_t kFewBytes = 4096;
constexpr std::chrono::seconds kAskAgain{1};  // of a connection with calls under way
constexpr std::chrono::milliseconds kBusyWindow{100};
// Honest bytes take a fifth of it, hashed and written. Of headers without an end each takes more
// the more there are: at 256 KiB in small frames 700 ns.
constexpr std::chrono::nanoseconds kTimeOfByte{50};
// That the memory grows before it is worth a look for what can be given back.
constexpr int64_t kGrowth = 32 << 20;
constexpr std::chrono::seconds kGiveBackAgain{1}, kGiveBackLate{5};
constexpr int kLinesPerSecond = 5;
constexpr int kPauses = 10;  // as long as the look before
// Of other threads. What costs less in a period is not a flood.
constexpr std::chrono::microseconds kLittleWork{500};

}  // namespace

ConnectionWatch::ConnectionWatch(OpenConnections* connections,
                                 const ConnectionJudge::Limits& limits, Hooks hooks)
    : connections_(connections),
      hooks_(std::move(hooks)),
      judge_(limits),
      first_resident_(ResidentBytes()),
      least_resident_(first_resident_),
      thread_([this](const std::stop_token& stop) { WatchUntil(stop); }) {}

ConnectionWatch::~ConnectionWatch() = default;

void ConnectionWatch::WatchUntil(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto start = Clock::now();
    if (IsDue(start)) Look(start);
    const auto pause = std::max<Clock::duration>(kPeriod, kPauses * (Clock::now() - start));
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, stop, pause, [] { return false; });
  }
}

bool ConnectionWatch::IsDue(Clock::time_point now) {
  const auto others = ProcessorTime() - ProcessorTimeOfThread();
  if (others - others_time_ < kLittleWork && now - looked_ < kIdlePeriod) return false;
  others_time_ = others;
  looked_ = now;
  return true;
}

bool ConnectionWatch::Busy(Clock::time_point now) {
  usage_.push_back({now, ProcessorTime(), read_});
  while (usage_.size() > 2 && now - usage_[1].when >= kBusyWindow) usage_.pop_front();
  const auto used = usage_.back().processors - usage_.front().processors;
  const int64_t read = usage_.back().read - usage_.front().read;
  return used > kTimeOfByte * read;
}

std::vector<ConnectionState> ConnectionWatch::States(Clock::time_point now) {
  const auto samples = connections_->Look();
  std::set<std::string> open;
  for (const auto& sample : samples) open.insert(sample.peer);
  bool refreshed = false;
  std::map<uint64_t, Asked> asked;
  std::vector<ConnectionState> states;
  states.reserve(samples.size());
  for (const auto& sample : samples) {
    ConnectionState state{sample.number, sample.address, sample.traffic, std::nullopt};
    Asked& last = asked[sample.number] = asked_[sample.number];
    read_ += sample.traffic.read - last.seen;
    last.seen = sample.traffic.read;
    if (sample.traffic.read - last.read >= kFewBytes ||
        (last.open > 0 && now - last.when >= kAskAgain)) {
      state.streams = view_.Of(sample.peer);
      if (!state.streams && !refreshed) {
        view_.Refresh(open);
        refreshed = true;
        state.streams = view_.Of(sample.peer);
      }
      last.read = sample.traffic.read;
      last.open = state.streams ? state.streams->open() : 0;
      last.when = now;
    }
    states.push_back(std::move(state));
  }
  asked_ = std::move(asked);
  return states;
}

void ConnectionWatch::Look(Clock::time_point now) {
  static LineRate rate(kLinesPerSecond);
  const auto states = States(now);
  const bool busy = Busy(now);
  const int64_t resident = ResidentBytes();
  for (const Offence& offence : judge_.Judge(states, busy, resident - hooks_.held_bytes(), now)) {
    if (!connections_->Abort(offence.number)) continue;
    hooks_.closed();
    if (const auto left_out = rate.Pass(now)) {
      EventFields fields = {{"closed", offence.words}};
      if (*left_out > 0) fields.emplace_back("left_out", std::to_string(*left_out));
      LogEvent("connection", fields);
    }
  }
  GiveBackMemory(resident, now);
}

void ConnectionWatch::GiveBackMemory(int64_t resident, Clock::time_point now) {
  least_resident_ = std::min(least_resident_, resident);
  // What was in use at the last time may be free by now.
  const bool grown = resident - least_resident_ >= kGrowth && now - gave_back_ >= kGiveBackAgain;
  const bool large = resident - first_resident_ >= kGrowth && now - gave_back_ >= kGiveBackLate;
  if (!grown && !large) return;
  gave_back_ = now;
  ReleaseToOs();
  least_resident_ = ResidentBytes();
}

}  // namespace rilievo
