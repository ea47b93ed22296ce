#include "server/rpc/progress_queue.h"

#include <utility>

#include "server/conversion/job_report.h"

namespace rilievo {
namespace {

constexpr std::chrono::milliseconds kMinInterval{100};

double SecondsBetween(ProgressQueue::Clock::time_point from, ProgressQueue::Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

}  // namespace

void ProgressQueue::Queued(Clock::time_point start) {
  start_ = start;
  v1::Progress event;
  event.set_stage(v1::STAGE_QUEUED);
  Push(std::move(event));
}

void ProgressQueue::Report(const Progress& progress, Clock::time_point now) {
  const bool new_stage = !begun_ || progress.stage != stage_;
  if (new_stage) {
    begun_ = true;
    stage_ = progress.stage;
    stage_start_ = now;
  } else if (progress.fraction < 1 && now - last_push_ < kMinInterval) {
    return;
  }
  last_push_ = now;
  v1::Progress event;
  event.set_stage(ProtoStage(progress.stage));
  event.set_fraction(progress.fraction);
  event.set_stage_seconds(SecondsBetween(stage_start_, now));
  event.set_total_seconds(SecondsBetween(start_, now));
  Push(std::move(event));
}

std::optional<v1::Progress> ProgressQueue::Pop() {
  if (pending_.empty()) return std::nullopt;
  v1::Progress event = std::move(pending_.front());
  pending_.pop_front();
  return event;
}

void ProgressQueue::Push(v1::Progress event) {
  // A stage that is not the last one pending may come back; its older event is then out of date.
  std::erase_if(pending_, [&](const v1::Progress& old) { return old.stage() == event.stage(); });
  pending_.push_back(std::move(event));
}

}  // namespace rilievo
