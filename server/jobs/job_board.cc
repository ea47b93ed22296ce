#include "server/jobs/job_board.h"

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/status_macros.h"
#include "server/conversion/memory_estimate.h"
#include "server/jobs/job_run.h"
#include "server/jobs/request_checks.h"
#include "server/rpc/grpc_status.h"

namespace rilievo {
namespace {

// A worker that is killed again and again, by the kernel for want of memory, will be so for ever.
constexpr int kMaxKills = 10;

absl::StatusCode CodeOf(const v1::Job& job) {
  if (job.state() == v1::JOB_STATE_SUCCEEDED) return absl::StatusCode::kOk;
  if (job.state() == v1::JOB_STATE_CANCELLED) return absl::StatusCode::kCancelled;
  return static_cast<absl::StatusCode>(job.error().code());
}

absl::Status Stopping() { return absl::UnavailableError("the server is shutting down"); }

}  // namespace

JobBoard::~JobBoard() {
  BeginDrain();
  std::unique_lock lock(mutex_);
  for (const auto& [id, live] : jobs_) {
    if (live.run) live.run->Stop(StopReason::kShutdown);
  }
  idle_.wait(lock, [this] { return running_ == 0; });
}

absl::Status JobBoard::Restore() {
  RILIEVO_ASSIGN_OR_RETURN(std::vector<StoredJob> unfinished, store_->Unfinished());
  for (StoredJob& stored : unfinished) {
    stored.job.set_state(v1::JOB_STATE_QUEUED);
    stored.job.set_sequence(SequenceOfState(v1::JOB_STATE_QUEUED, stored.job.attempts()));
    Add(std::move(stored));
  }
  return absl::OkStatus();
}

void JobBoard::Add(StoredJob stored) {
  const std::string id = stored.job.job_id();
  const std::lock_guard lock(mutex_);
  LiveJob& live = jobs_[id];
  live.events = std::make_shared<JobEvents>(stored.job);
  const auto parsed = ParseHeader(stored.header, core_->options);
  if (const auto* request = std::get_if<JobRequest>(&parsed))
    live.memory = EstimateMemory(*request);
  live.stored = std::move(stored);
  Submit(id, &live);
}

void JobBoard::Submit(const std::string& job_id, LiveJob* live) {
  if (draining_) {
    live->events->Close(Stopping());
    return;
  }
  ++running_;
  live->work_number = core_->pool.Submit([this, job_id] { Work(job_id); },
                                         {.client = live->stored.client, .memory = live->memory});
}

int JobBoard::size() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(jobs_.size());
}

int JobBoard::size(const std::string& client) const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(std::count_if(jobs_.begin(), jobs_.end(), [&](const auto& job) {
    return job.second.stored.client == client;
  }));
}

std::shared_ptr<JobEvents> JobBoard::EventsOf(const std::string& job_id) const {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job_id);
  return found == jobs_.end() ? nullptr : found->second.events;
}

void JobBoard::Work(const std::string& job_id) {
  if (const auto run = BeginRun(job_id)) EndRun(run);
  const std::lock_guard lock(mutex_);
  --running_;
  idle_.notify_all();  // under the lock: whoever waits may destroy this object
}

std::shared_ptr<JobRun> JobBoard::BeginRun(const std::string& job_id) {
  std::shared_ptr<JobRun> run;
  std::shared_ptr<JobEvents> events;
  {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(job_id);
    if (found == jobs_.end() || draining_) return nullptr;
    LiveJob& live = found->second;
    events = live.events;
    v1::Job& job = live.stored.job;
    job.set_state(v1::JOB_STATE_RUNNING);
    if (!std::exchange(live.untried, false)) job.set_attempts(job.attempts() + 1);
    job.set_sequence(SequenceOfState(job.state(), job.attempts()));
    SetTime(job.mutable_start_time());
    run = live.run = std::make_shared<JobRun>(core_, store_, live.stored, events);
  }
  core_->live_calls.Enter(run);
  // On a full disk the job is worked on all the same: its end waits until there is room.
  const absl::Status kept = store_->Update(run->stored());
  if (absl::IsFailedPrecondition(kept)) {
    // Cancelled or removed while it was not on the board.
    TakeOff(run->stored(), kept);
    core_->live_calls.Leave(run.get());
    return nullptr;
  }
  if (kept.ok()) events->Push(run->stored().job);
  return run;
}

void JobBoard::EndRun(const std::shared_ptr<JobRun>& run) {
  const std::string& id = run->stored().job.job_id();
  const JobOutcome outcome = run->Work();
  using Kind = JobOutcome::Kind;
  const bool again = outcome.kind == Kind::kKilled && Requeue(id);
  if (outcome.kind == Kind::kUntried) {
    RequeueUntried(run->stored());
  } else if (!again && outcome.kind != Kind::kAbandoned) {
    const absl::Status kept = run->Keep(outcome);
    if (kept.ok()) {
      Publish(outcome.job.job);
    } else if (!absl::IsResourceExhausted(kept)) {  // else the server ends before there was room
      TakeOff(outcome.job, kept);
    }
  }
  {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found != jobs_.end() && found->second.run == run) found->second.run = nullptr;
  }
  core_->live_calls.Leave(run.get());
}

void JobBoard::Publish(const v1::Job& job) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job.job_id());
  if (found == jobs_.end()) return;
  core_->metrics->CountKeptJob(CodeOf(job));
  found->second.events->Push(job);
  jobs_.erase(found);
}

void JobBoard::TakeOff(StoredJob stored, absl::Status refusal) {
  if (!absl::IsFailedPrecondition(refusal)) {
    v1::Job& job = stored.job;
    job.set_state(v1::JOB_STATE_FAILED);
    job.clear_surface();
    job.clear_report();
    *job.mutable_error() = RpcStatus(ErrorOfStore(absl::InternalError(refusal.message())));
    stored.surface.clear();
    job.set_sequence(SequenceOfState(job.state(), job.attempts()));
    refusal = store_->Update(stored);
    // What the store does not take either stays RUNNING there: the next server works on it again.
    if (!absl::IsFailedPrecondition(refusal)) return Publish(job);
  }
  const absl::StatusOr<StoredJob> held = store_->Get(stored.owner, stored.job.job_id());
  if (held.ok()) return Publish(held->job);
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(stored.job.job_id());
  if (found == jobs_.end()) return;
  found->second.events->Close(held.status());
  jobs_.erase(found);
}

bool JobBoard::Requeue(const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job_id);
  if (found == jobs_.end()) return true;  // cancelled meanwhile
  LiveJob& live = found->second;
  if (++live.kills >= kMaxKills) return false;
  v1::Job& job = live.stored.job;
  job.set_state(v1::JOB_STATE_QUEUED);
  job.set_sequence(SequenceOfState(job.state(), job.attempts()));
  // On disk it is RUNNING, which a later server takes for the same.
  live.events->Push(job);
  Submit(job_id, &live);
  return true;
}

void JobBoard::RequeueUntried(StoredJob stored) {
  v1::Job& job = stored.job;
  job.set_state(v1::JOB_STATE_QUEUED);
  job.set_sequence(SequenceOfState(job.state(), job.attempts()));
  // It may wait for long: who asks the store is to learn of it, and a later server that it did not
  // end while it was worked on. A job that was cancelled meanwhile is refused, and is off the
  // board.
  store_->Update(stored).IgnoreError();
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job.job_id());
  if (found == jobs_.end()) return;
  LiveJob& live = found->second;
  live.untried = true;
  live.stored = std::move(stored);
  live.events->Push(live.stored.job);
  Submit(live.stored.job.job_id(), &live);
}

absl::StatusOr<v1::Job> JobBoard::Cancel(const std::string& owner, const std::string& job_id) {
  RILIEVO_ASSIGN_OR_RETURN(StoredJob stored, store_->Get(owner, job_id));
  if (IsFinished(stored.job.state())) return stored.job;
  {
    // The attempts that are on disk may be fewer: their numbers must not come again.
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(job_id);
    if (found != jobs_.end()) stored = found->second.stored;
  }
  stored.job.set_state(v1::JOB_STATE_CANCELLED);
  stored.job.set_sequence(SequenceOfState(stored.job.state(), stored.job.attempts()));
  SetTime(stored.job.mutable_end_time());
  const absl::Status kept = store_->Update(stored);
  if (absl::IsFailedPrecondition(kept)) {  // it ended just now
    RILIEVO_ASSIGN_OR_RETURN(stored, store_->Get(owner, job_id));
    return stored.job;
  }
  RILIEVO_RETURN_IF_ERROR(kept);
  std::shared_ptr<JobRun> run;
  {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(job_id);
    if (found != jobs_.end()) {
      run = found->second.run;
      if (core_->pool.Withdraw(found->second.work_number)) --running_;
    }
  }
  if (run) run->Stop(StopReason::kClient);
  Publish(stored.job);
  return stored.job;
}

void JobBoard::BeginDrain() {
  const std::lock_guard lock(mutex_);
  draining_ = true;
  for (auto& [id, live] : jobs_) {
    if (core_->pool.Withdraw(live.work_number)) --running_;
    live.events->Close(Stopping());
  }
}

}  // namespace rilievo
