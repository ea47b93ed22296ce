// The board beside others that share its store, and at its end.
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/jobs/job_board.h"
#include "server/observability/server_log.h"
#include "server/rpc/job_error.h"

namespace rilievo {
namespace {

// The store is away, or has no room or connection left just now.
bool IsTemporary(const absl::Status& status) {
  return absl::IsUnavailable(status) || absl::IsResourceExhausted(status);
}

}  // namespace

void JobBoard::TakeUp(StoredJob stored) {
  const int before = stored.unclean_ends;
  stored = AsLeft(std::move(stored));
  // What cannot be written now is RUNNING there, which whoever comes next takes for the same.
  if (stored.unclean_ends != before) store_->Update(stored).IgnoreError();
  if (!IsFinished(stored.job.state())) Add(std::move(stored));
}

void JobBoard::HandOver(std::map<std::string, LiveJob>::iterator job) {
  const auto& live = job->second;
  elsewhere_[job->first] = {live.stored.owner, live.events, live.stored.job.sequence()};
  Erase(job);
}

void JobBoard::GiveBack(const std::string& job_id) {
  StoredJob stored;
  {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(job_id);
    if (found == jobs_.end() || found->second.stored.claim == 0) return;
    stored = found->second.stored;
  }
  store_->Release(stored).IgnoreError();
}

std::shared_ptr<JobEvents> JobBoard::EventsElsewhere(const std::string& owner, const v1::Job& job) {
  const std::lock_guard lock(mutex_);
  const auto here = jobs_.find(job.job_id());  // claimed just now
  if (here != jobs_.end()) return here->second.events;
  Elsewhere& other = elsewhere_[job.job_id()];
  auto events = other.events.lock();
  if (events) return events;
  events = std::make_shared<JobEvents>(job);
  if (draining_) events->Close(StatusOf(ShutdownError()));
  other = {owner, events, job.sequence()};
  return events;
}

void JobBoard::FollowOthers(std::chrono::steady_clock::time_point until) {
  std::vector<std::pair<std::string, Elsewhere>> others;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(elsewhere_, [](const auto& other) { return other.second.events.expired(); });
    const auto next = elsewhere_.upper_bound(followed_);
    others.assign(next, elsewhere_.end());
    others.insert(others.end(), elsewhere_.begin(), next);
  }
  for (const auto& [id, other] : others) {
    const auto events = other.events.lock();
    if (!events) continue;
    const auto glance = store_->Look(other.owner, id);
    followed_ = id;
    if (IsTemporary(glance.status())) return;
    if (!glance.ok()) {
      events->Close(glance.status());
      continue;
    }
    const uint64_t state = glance->job.sequence();
    if (state != other.state) events->Push(glance->job);
    if (glance->event) events->Follow(*glance->event);
    const std::lock_guard lock(mutex_);
    const auto found = elsewhere_.find(id);
    if (found != elsewhere_.end()) found->second.state = state;
    if (std::chrono::steady_clock::now() >= until) return;
  }
}

void JobBoard::TellOthers() {
  std::vector<std::pair<JobClaim, v1::JobEvent>> news;
  {
    const std::lock_guard lock(mutex_);
    for (auto& [id, live] : jobs_) {
      auto event = live.events->LatestProgress();
      if (!event || event->sequence() == live.told) continue;
      live.told = event->sequence();
      news.emplace_back(
          JobClaim{.job_id = id, .number = live.stored.claim, .worker = live.stored.worker},
          *std::move(event));
    }
  }
  for (const auto& [claim, event] : news) {
    if (!store_->Tell(claim, event).ok()) return;
  }
}

void JobBoard::Compare(const std::vector<JobClaim>& held) {
  std::map<std::string, JobClaim> unknown;
  for (const JobClaim& claim : held) unknown[claim.job_id] = claim;
  std::vector<std::string> lost;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, live] : jobs_) {
      const auto found = unknown.find(id);
      const bool ours = found != unknown.end() && found->second.number == live.stored.claim;
      if (ours) unknown.erase(found);
      if (!ours) lost.push_back(id);
    }
  }
  for (const std::string& id : lost) Lose(id);
  for (const auto& [id, claim] : unknown) store_->Release(claim).IgnoreError();
}

void JobBoard::BeginDrain() {
  std::vector<std::string> never_begun;
  {
    const std::lock_guard lock(mutex_);
    draining_ = true;
    for (auto& [id, live] : jobs_) {
      live.events->Close(StatusOf(ShutdownError()));
      if (!core_->pool.Withdraw(live.work_number)) continue;
      --running_;
      never_begun.push_back(id);
    }
    for (auto& [id, other] : elsewhere_) {
      if (const auto events = other.events.lock()) events->Close(StatusOf(ShutdownError()));
    }
  }
  for (const std::string& id : never_begun) GiveBack(id);
}

void JobBoard::Lose(const std::string& job_id) {
  std::shared_ptr<JobRun> run;
  StoredJob stored;
  {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(job_id);
    if (found == jobs_.end()) return;
    run = found->second.run;
    stored = found->second.stored;
    if (core_->pool.Withdraw(found->second.work_number)) --running_;
  }
  if (run) run->Stop(StopReason::kClient);
  TakeOff(stored);
}

}  // namespace rilievo
