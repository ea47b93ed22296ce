#include "server/jobs/job_events.h"

#include <algorithm>
#include <utility>

#include "server/store/job_store.h"

namespace rilievo {
namespace {

constexpr uint64_t kEventsOfAttempt = uint64_t{1} << 20;

// Whether `later` says all that `earlier` did.
bool Replaces(const v1::JobEvent& later, const v1::JobEvent& earlier) {
  if (later.has_job() && earlier.has_job()) return later.job().state() == earlier.job().state();
  if (later.has_job() && earlier.has_progress()) {
    return later.job().state() == v1::JOB_STATE_QUEUED ||
           later.job().state() == v1::JOB_STATE_RUNNING;  // a new attempt
  }
  return later.has_progress() && earlier.has_progress() &&
         later.progress().stage() == earlier.progress().stage();
}

}  // namespace

uint64_t SequenceOfState(v1::JobState state, uint32_t attempts) {
  const uint64_t first = attempts * kEventsOfAttempt;
  if (IsFinished(state)) return first + kEventsOfAttempt - 1;
  if (state == v1::JOB_STATE_RUNNING) return first;
  return attempts == 0 ? 1 : first + kEventsOfAttempt / 2;  // back in the queue
}

JobEvents::JobEvents(const v1::Job& job)
    : last_(job.sequence()), finished_(IsFinished(job.state())) {
  v1::JobEvent event;
  event.set_sequence(job.sequence());
  *event.mutable_job() = job;
  events_.push_back(std::move(event));
}

void JobEvents::Push(const v1::Job& job) {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  // An attempt that did not count comes again with the number that it had.
  last_ = std::max(job.sequence(), last_ + 1);
  finished_ = IsFinished(job.state());
  v1::JobEvent event;
  *event.mutable_job() = job;
  event.mutable_job()->set_sequence(last_);
  Append(std::move(event));
}

void JobEvents::Push(v1::Progress progress) {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  ++last_;
  v1::JobEvent event;
  *event.mutable_progress() = std::move(progress);
  Append(std::move(event));
}

void JobEvents::Follow(const v1::JobEvent& told) {
  const std::lock_guard lock(mutex_);
  if (finished_ || told.sequence() <= last_) return;
  last_ = told.sequence();
  Append(told);
}

std::optional<v1::JobEvent> JobEvents::LatestProgress() const {
  const std::lock_guard lock(mutex_);
  if (!events_.back().has_progress()) return std::nullopt;
  return events_.back();
}

void JobEvents::Append(v1::JobEvent event) {
  event.set_sequence(last_);
  std::erase_if(events_, [&](const v1::JobEvent& old) { return Replaces(event, old); });
  events_.push_back(std::move(event));
  Notify();
}

void JobEvents::Close(const absl::Status& reason) {
  const std::lock_guard lock(mutex_);
  if (!finished_ && !closed_) closed_ = reason;
  Notify();
}

std::optional<v1::JobEvent> JobEvents::After(uint64_t sequence) const {
  const std::lock_guard lock(mutex_);
  const auto found = std::find_if(events_.begin(), events_.end(), [&](const v1::JobEvent& event) {
    return event.sequence() > sequence;
  });
  if (found == events_.end()) return std::nullopt;
  return *found;
}

std::optional<absl::Status> JobEvents::EndAfter(uint64_t sequence) const {
  const std::lock_guard lock(mutex_);
  if (closed_) return closed_;
  if (finished_ && events_.back().sequence() <= sequence) return absl::OkStatus();
  return std::nullopt;
}

void JobEvents::Watch(const void* key, std::function<void()> notify) {
  const std::lock_guard lock(mutex_);
  watchers_[key] = std::move(notify);
}

void JobEvents::Unwatch(const void* key) {
  const std::lock_guard lock(mutex_);
  watchers_.erase(key);
}

void JobEvents::Notify() const {
  for (const auto& [key, notify] : watchers_) notify();
}

}  // namespace rilievo
