#include "server/jobs/job_run.h"

#include <array>
#include <chrono>
#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "server/conversion/memory_estimate.h"
#include "server/observability/server_log.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/job_error.h"
#include "server/store/control_mesh_blob.h"

namespace rilievo {
namespace {

// Where scans cannot be read whoever tries again at once gets no further, and keeps others from it.
constexpr std::chrono::seconds kReadPause{1};

v1::Job FailedRun(v1::Job job, const CallError& error) {
  job.set_state(v1::JOB_STATE_FAILED);
  *job.mutable_error() = RpcStatus(error);
  return job;
}

v1::Job Succeeded(v1::Job job, const JobResult& result) {
  job.set_state(v1::JOB_STATE_SUCCEEDED);
  uint64_t total = 0;
  Sha256 hash;
  for (const auto& chunk : result.encoded.chunks) {
    hash.Add(chunk);
    job.mutable_surface()->add_chunk_bytes(chunk.size());
    total += chunk.size();
  }
  job.mutable_surface()->set_total_bytes(total);
  const std::array<uint8_t, 32> digest = hash.Finish();
  job.mutable_surface()->set_sha256(digest.data(), digest.size());
  *job.mutable_report() = result.report;
  return job;
}

}  // namespace

void SetTime(google::protobuf::Timestamp* time) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(now);
  time->set_seconds(seconds.count());
  time->set_nanos(static_cast<int32_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(now - seconds).count()));
}

JobRun::JobRun(ServiceCore* core, JobStore* store, StoredJob stored,
               std::shared_ptr<JobEvents> events)
    : core_(core),
      store_(store),
      stored_(std::move(stored)),
      events_(std::move(events)),
      number_(core->next_job++),
      begin_(Clock::now()) {
  progress_.Queued(begin_);
  progress_.Clear();
}

absl::Status JobRun::NotToBeHad(const absl::Status& status) {
  core_->pool.Hold(kReadPause);
  return absl::UnavailableError(status.message());
}

absl::StatusOr<JobResult> JobRun::Reconstruct(JobRequest* job) {
  const auto header = WholeHeader(store_->blobs(), stored_);
  if (absl::IsFailedPrecondition(header.status())) return header.status();
  if (!header.ok()) return NotToBeHad(header.status());
  auto parsed = ParseHeader(*header, core_->options);
  if (const auto* error = std::get_if<CallError>(&parsed)) {
    return StatusOf(*error);
  }
  *job = std::get<JobRequest>(std::move(parsed));
  if (stored_.job.part_points() > 0) {
    const std::string& scratch = core_->options.scratch;
    if (scratch.empty()) {
      return NotToBeHad(absl::UnavailableError(
          "the job is to be made by parts, and this worker has no --scratch"));
    }
    if (store_->shared()) {
      parts_ = std::make_shared<PartsInStore>(store_, stored_, core_->options, stop_.get_token());
    }
    job->parts = {static_cast<int64_t>(stored_.job.part_points()), ScratchFolder(scratch), parts_};
  }
  absl::StatusOr<FileDescriptor> scan = store_->blobs().Read(stored_.job.scan_id());
  if (absl::IsNotFound(scan.status()) || absl::IsDataLoss(scan.status())) {
    return absl::DataLossError("the stored scan is gone");
  }
  if (!scan.ok()) return NotToBeHad(scan.status());
  RunContext context;
  context.stop = stop_.get_token();
  context.threads = job->threads;
  context.seed = job->seed;
  context.progress = [this](const Progress& progress) {
    progress_.Report(progress, Clock::now());
    while (auto event = progress_.Pop()) {
      if (events_) events_->Push(*std::move(event));
    }
  };
  return core_->work(*job, ScanBytes(*std::move(scan), stored_.job.scan_id()), context);
}

StopReason JobRun::EndWork() {
  const std::lock_guard lock(mutex_);
  working_ = false;
  return stop_reason_;
}

absl::Status JobRun::Help() {
  JobRequest request;
  const absl::Status done = Reconstruct(&request).status();
  EndWork();
  const int kept = parts_ ? parts_->kept() : 0;
  if (kept > 0)
    LogMessage(absl::StrCat("job ", stored_.job.job_id(), ": helped with ", kept, " parts"));
  return done;
}

JobOutcome JobRun::Work() {
  JobRequest request;
  absl::StatusOr<JobResult> result = Reconstruct(&request);
  if (absl::IsDataLoss(result.status())) {
    // Whoever makes a job of this scan next is asked for its bytes.
    store_->SetScanAside(stored_.job.scan_id()).IgnoreError();
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - begin_).count();
  const StopReason reason = EndWork();
  JobOutcome outcome{JobOutcome::Kind::kFinished, stored_, {}, parts_ && parts_->kept() > 0};
  v1::Job& job = outcome.job.job;
  if (result.ok()) {
    job = Succeeded(std::move(job), *result);
    outcome.surface = std::move(result->encoded.chunks);
  } else if (reason == StopReason::kJobTime) {
    job = FailedRun(std::move(job), StopError(reason, core_->options));
  } else if (reason != StopReason::kNone) {
    outcome.kind = JobOutcome::Kind::kAbandoned;
  } else {
    if (absl::IsAborted(result.status())) outcome.kind = JobOutcome::Kind::kKilled;
    if (absl::IsUnavailable(result.status())) outcome.kind = JobOutcome::Kind::kUntried;
    job = FailedRun(
        std::move(job),
        ErrorOfJob(result.status(), FieldAtFault(progress_.stage(), request, result.status()),
                   absl::StrCat("job ", job.job_id())));
  }
  SetTime(job.mutable_end_time());
  job.set_sequence(SequenceOfState(job.state(), job.attempts()));
  Log(outcome, request, result, seconds);
  return outcome;
}

void JobRun::Log(const JobOutcome& outcome, const JobRequest& request,
                 const absl::StatusOr<JobResult>& result, double seconds) const {
  const v1::Job& job = outcome.job.job;
  JobRecord record;
  record.job = number_;
  record.id = job.job_id();
  record.code = job.state() == v1::JOB_STATE_SUCCEEDED         ? absl::StatusCode::kOk
                : outcome.kind == JobOutcome::Kind::kAbandoned ? absl::StatusCode::kCancelled
                : outcome.kind == JobOutcome::Kind::kKilled
                    ? absl::StatusCode::kAborted
                    : static_cast<absl::StatusCode>(job.error().code());
  record.detail = DetailOf(result.status());
  record.peak_bytes = PeakBytes(result);
  record.estimated_bytes = EstimateMemory(request);
  record.points_announced = static_cast<int64_t>(stored_.header.point_count());
  record.bytes_out = static_cast<int64_t>(job.surface().total_bytes());
  record.work_seconds = record.total_seconds = seconds;
  record.road = job.report().road();
  record.stage_seconds = SecondsByStage(job.report());
  record.owner = stored_.owner;
  record.trace_id = job.trace_id();
  core_->Report(record);
}

absl::Status JobRun::Keep(const JobOutcome& outcome, JobStore* store) {
  return outcome.job.job.state() == v1::JOB_STATE_SUCCEEDED
             ? store->Finish(outcome.job, outcome.surface)
             : store->Update(outcome.job);
}

bool JobRun::stopped() const {
  const std::lock_guard lock(mutex_);
  return stop_reason_ != StopReason::kNone;
}

void JobRun::Tick(Clock::time_point now) {
  bool late;
  {
    const std::lock_guard lock(mutex_);
    late = working_ && now - begin_ > core_->options.max_job_time;
  }
  if (late) Stop(StopReason::kJobTime);
}

void JobRun::Stop(StopReason reason) {
  {
    const std::lock_guard lock(mutex_);
    if (stop_reason_ == StopReason::kNone) stop_reason_ = reason;
  }
  stop_.request_stop();
}

}  // namespace rilievo
