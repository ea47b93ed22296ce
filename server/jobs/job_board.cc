#include "server/jobs/job_board.h"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/memory_estimate.h"
#include "server/jobs/job_run.h"
#include "server/jobs/request_checks.h"
#include "server/observability/server_log.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/job_error.h"
#include "server/store/control_mesh_blob.h"

namespace rilievo {
namespace {

// A job whose attempts end with their worker or with the server again and again, as for want of
// memory, will do so for ever.
constexpr int kMaxUncleanEnds = 10;
// Of surfaces that wait for the store; beyond, the threads that compute wait too.
constexpr int64_t kMaxUnkeptBytes = 256 << 20;
constexpr std::chrono::milliseconds kStorePause{200};

bool MayPassLater(const absl::Status& status) {
  return absl::IsResourceExhausted(status) || absl::IsUnavailable(status);
}

int64_t BytesOf(const JobOutcome& outcome) {
  int64_t bytes = 0;
  for (const auto& part : outcome.surface) bytes += static_cast<int64_t>(part.size());
  return bytes;
}

v1::Job Queued(v1::Job job) {
  job.set_state(v1::JOB_STATE_QUEUED);
  job.set_sequence(SequenceOfState(v1::JOB_STATE_QUEUED, job.attempts()));
  return job;
}

v1::Job Failed(v1::Job job, const CallError& error) {
  job.set_state(v1::JOB_STATE_FAILED);
  job.clear_surface();
  job.clear_report();
  *job.mutable_error() = RpcStatus(error);
  SetTime(job.mutable_end_time());
  job.set_sequence(SequenceOfState(v1::JOB_STATE_FAILED, job.attempts()));
  return job;
}

absl::StatusCode CodeOf(const v1::Job& job) {
  if (job.state() == v1::JOB_STATE_SUCCEEDED) return absl::StatusCode::kOk;
  if (job.state() == v1::JOB_STATE_CANCELLED) return absl::StatusCode::kCancelled;
  return static_cast<absl::StatusCode>(job.error().code());
}

absl::Status Stopping() { return StatusOf(ShutdownError()); }

}  // namespace

JobBoard::~JobBoard() {
  BeginDrain();
  std::unique_lock lock(mutex_);
  for (const auto& [id, live] : jobs_) {
    if (live.run) live.run->Stop(StopReason::kShutdown);
  }
  idle_.wait(lock, [this] { return running_ == 0; });
}

StoredJob JobBoard::AsLeft(StoredJob stored) {
  // The server that worked on it has had no time to write another state.
  if (stored.job.state() != v1::JOB_STATE_RUNNING) return stored;
  ++stored.unclean_ends;
  stored.job = stored.unclean_ends < kMaxUncleanEnds
                   ? Queued(std::move(stored.job))
                   : Failed(std::move(stored.job),
                            ErrorOfJob(absl::AbortedError("the server or the job's worker was "
                                                          "killed at each attempt"),
                                       "", ""));
  return stored;
}

absl::Status JobBoard::Restore() {
  if (store_->shared()) return absl::OkStatus();
  RILIEVO_ASSIGN_OR_RETURN(std::vector<StoredJob> unfinished, store_->Unfinished());
  for (StoredJob& stored : unfinished) {
    const int before = stored.unclean_ends;
    stored = AsLeft(std::move(stored));
    // A job starts even if that cannot be written.
    if (stored.unclean_ends != before) store_->Update(stored).IgnoreError();
  }
  std::stable_partition(unfinished.begin(), unfinished.end(),
                        [](const StoredJob& stored) { return !IsSuspect(stored); });
  for (StoredJob& stored : unfinished) {
    if (!IsFinished(stored.job.state())) Add(std::move(stored));
  }
  return absl::OkStatus();
}

// One whose mesh is lost needs none, and fails as soon as it begins.
int64_t JobBoard::MemoryOf(const StoredJob& stored) const {
  const auto header = WholeHeader(store_->blobs(), stored);
  if (!header.ok()) return 0;
  auto parsed = ParseHeader(*header, core_->options);
  auto* request = std::get_if<JobRequest>(&parsed);
  if (request == nullptr) return 0;
  if (const auto points = static_cast<int64_t>(stored.job.part_points()); points > 0) {
    request->parts = PartsRequest{points, ScratchFolder(core_->options.scratch)};
  }
  return EstimateMemory(*request);
}

void JobBoard::Add(StoredJob stored) {
  const std::string id = stored.job.job_id();
  // The thread that claims jobs has leases to renew: it does not wait for a mesh from far away.
  const int64_t memory = stored.claim != 0 ? stored.memory : MemoryOf(stored);
  const std::lock_guard lock(mutex_);
  LiveJob& live = jobs_[id];
  const auto watched = elsewhere_.find(id);
  if (watched != elsewhere_.end()) live.events = watched->second.events.lock();
  if (watched != elsewhere_.end()) elsewhere_.erase(watched);
  if (!live.events) live.events = std::make_shared<JobEvents>(stored.job);
  live.memory = memory;
  live.stored = std::move(stored);
  Submit(id, &live);
}

void JobBoard::Submit(const std::string& job_id, LiveJob* live) {
  if (draining_) {
    live->events->Close(Stopping());
    return;
  }
  ++running_;
  live->work_number = core_->pool.Submit(
      [this, job_id] { Work(job_id); },
      {.client = live->stored.client, .memory = live->memory, .last = IsSuspect(live->stored)});
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
  if (const auto run = BeginRun(job_id)) {
    EndRun(run);
  } else {
    GiveBack(job_id);
  }
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
    TakeOff(run->stored());
    core_->live_calls.Leave(run.get());
    return nullptr;
  }
  if (kept.ok()) events->Push(run->stored().job);
  return run;
}

void JobBoard::EndRun(const std::shared_ptr<JobRun>& run) {
  const std::string& id = run->stored().job.job_id();
  JobOutcome outcome = run->Work();
  using Kind = JobOutcome::Kind;
  const bool again = outcome.kind == Kind::kKilled && Requeue(run->stored(), outcome.got_on);
  if (outcome.kind == Kind::kUntried) {
    RequeueUntried(run->stored());
  } else if (outcome.kind == Kind::kAbandoned) {
    PutBack(run->stored());
  } else if (!again) {
    Conclude(*run, std::move(outcome));
  }
  {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(id);
    if (found != jobs_.end() && found->second.run == run) found->second.run = nullptr;
  }
  core_->live_calls.Leave(run.get());
}

void JobBoard::PutBack(StoredJob stored) {
  stored.job = Queued(std::move(stored.job));
  stored.unclean_ends = 0;
  // A job that was cancelled is finished by now, and stays so.
  store_->Release(stored).IgnoreError();
}

void JobBoard::Conclude(const JobRun& run, JobOutcome outcome) {
  while (!Keep(&outcome) && !PutOff(&outcome)) {
    if (run.stopped()) return;
    std::this_thread::sleep_for(kStorePause);
  }
}

bool JobBoard::Keep(JobOutcome* outcome) {
  absl::Status kept = JobRun::Keep(*outcome, store_);
  if (!kept.ok() && !MayPassLater(kept) && !absl::IsFailedPrecondition(kept)) {
    StoredJob& stored = outcome->job;
    stored.job = Failed(std::move(stored.job), ErrorOfStore(absl::InternalError(kept.message())));
    stored.surface.clear();
    outcome->surface.clear();
    kept = store_->Update(stored);
  }
  if (kept.ok()) {
    Publish(outcome->job.job);
  } else if (absl::IsFailedPrecondition(kept)) {
    TakeOff(outcome->job);
  }
  return kept.ok() || absl::IsFailedPrecondition(kept);
}

bool JobBoard::PutOff(JobOutcome* outcome) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(outcome->job.job.job_id());
  if (!IsOn(found, outcome->job)) return true;  // cancelled meanwhile
  const int64_t bytes = BytesOf(*outcome);
  if (unkept_bytes_ > 0 && unkept_bytes_ + bytes > kMaxUnkeptBytes) return false;
  unkept_bytes_ += bytes;
  found->second.unkept = std::move(*outcome);
  return true;
}

void JobBoard::KeepResults() {
  std::vector<std::string> ids;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, live] : jobs_) {
      if (live.unkept) ids.push_back(id);
    }
  }
  for (const std::string& id : ids) {
    JobOutcome outcome;
    {
      const std::lock_guard lock(mutex_);
      const auto found = jobs_.find(id);
      if (found == jobs_.end() || !found->second.unkept) continue;
      outcome = *std::move(found->second.unkept);
      found->second.unkept.reset();
      unkept_bytes_ -= BytesOf(outcome);
    }
    if (!Keep(&outcome) && !PutOff(&outcome)) return;
  }
}

void JobBoard::Publish(const v1::Job& job) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job.job_id());
  if (found == jobs_.end()) return;
  core_->metrics->CountKeptJob(CodeOf(job));
  found->second.events->Push(job);
  Erase(found);
}

void JobBoard::Erase(std::map<std::string, LiveJob>::iterator job) {
  if (job->second.unkept) unkept_bytes_ -= BytesOf(*job->second.unkept);
  jobs_.erase(job);
}

void JobBoard::TakeOff(const StoredJob& stored) {
  const std::string& id = stored.job.job_id();
  const absl::StatusOr<StoredJob> held = store_->Get(stored.owner, id);
  const bool goes_on = held.ok() && stored.claim != 0 && !IsFinished(held->job.state());
  if (goes_on || (held.ok() && held->job.attempts() > stored.job.attempts())) NoteDropped(stored);
  if (held.ok() && !goes_on) return Publish(held->job);
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  if (!IsOn(found, stored)) return;
  if (goes_on) return HandOver(found);
  found->second.events->Close(held.status());
  Erase(found);
}

void JobBoard::NoteDropped(const StoredJob& stored) {
  {
    const std::lock_guard lock(mutex_);
    if (!IsOn(jobs_.find(stored.job.job_id()), stored)) return;  // it was noted before
  }
  core_->metrics->CountDroppedResult();
  LogMessage(absl::StrCat("job ", stored.job.job_id(),
                          ": another worker has taken it; what was done ", "here is dropped"));
}

bool JobBoard::Requeue(const StoredJob& tried, bool got_on) {
  const std::string& job_id = tried.job.job_id();
  StoredJob stored;
  {
    const std::lock_guard lock(mutex_);
    const auto found = jobs_.find(job_id);
    if (!IsOn(found, tried)) return true;  // cancelled meanwhile
    LiveJob& live = found->second;
    if (got_on) live.stored.unclean_ends = 0;
    if (++live.stored.unclean_ends >= kMaxUncleanEnds) return false;
    live.stored.job = Queued(std::move(live.stored.job));
    stored = live.stored;
  }
  // What cannot be written now is RUNNING there, which a later server takes for the same.
  store_->Update(stored).IgnoreError();
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job_id);
  if (!IsOn(found, tried)) return true;
  found->second.events->Push(stored.job);
  Submit(job_id, &found->second);
  return true;
}

void JobBoard::RequeueUntried(StoredJob stored) {
  v1::Job& job = stored.job;
  job.set_state(v1::JOB_STATE_QUEUED);
  job.set_sequence(SequenceOfState(job.state(), job.attempts()));
  // It may wait for long: who asks the store is to learn of it, and a later server that it did not
  // end while it was worked on. A job that was cancelled meanwhile is refused, and is off the
  // board. Others who share the store may be able to, and take it for the same attempt.
  if (stored.claim != 0) job.set_attempts(job.attempts() - 1);
  store_->Release(stored, /*last=*/true).IgnoreError();
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job.job_id());
  if (!IsOn(found, stored)) return;
  if (stored.claim != 0) return HandOver(found);
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
  stored.claim = 0;  // whoever works on it
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

}  // namespace rilievo
