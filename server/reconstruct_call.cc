#include "server/reconstruct_call.h"

#include <utility>
#include <variant>

#include "absl/strings/str_cat.h"
#include "server/conversion/memory_estimate.h"
#include "server/conversion/scan_size.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/job_error.h"
#include "server/rpc/unread_message.h"

namespace rilievo {
namespace {

double SecondsBetween(LiveCall::Clock::time_point from, LiveCall::Clock::time_point to) {
  return std::chrono::duration<double>(to - from).count();
}

CallError OrderError(const std::string& field, const std::string& description) {
  return BadRequestError({{field, description}}, ErrorCause::kMessageOrder);
}

}  // namespace

ReconstructCall* ReconstructCall::Begin(ServiceCore* core, DiskPool* disk,
                                        grpc::CallbackServerContext* context, Caller caller) {
  auto call = std::make_shared<ReconstructCall>(core, disk, context, std::move(caller));
  ReconstructCall* reactor = call.get();
  // Held until the first operation is started: a Stop() from elsewhere comes after it.
  const std::lock_guard lock(reactor->mutex_);
  core->live_calls.Enter(call, call->caller_.client);
  reactor->self_ = std::move(call);
  if (core->draining) {
    reactor->Fail(ShutdownError());
  } else {
    reactor->ReadNext();
  }
  return reactor;
}

ReconstructCall::ReconstructCall(ServiceCore* core, DiskPool* disk,
                                 grpc::CallbackServerContext* context, Caller caller)
    : core_(core),
      disk_(disk),
      context_(context),
      caller_(std::move(caller)),
      begin_(Clock::now()),
      last_transfer_(begin_) {
  record_.job = core_->next_job++;
  record_.owner = caller_.owner;
  record_.trace_id = caller_.trace_id;
  record_.parent_id = caller_.parent_id;
}

ReconstructCall::~ReconstructCall() {
  record_.total_seconds = SecondsBetween(begin_, Clock::now());
  if (!job_.parts) core_->upload_bytes -= record_.bytes_in;
  core_->metrics->CountReceived(record_.bytes_in);
  core_->metrics->CountSent(record_.bytes_out);
  core_->Report(record_);
  ticket_.reset();
  core_->live_calls.Leave(this);
}

void ReconstructCall::OnReadDone(bool ok) {
  const std::lock_guard lock(mutex_);
  if (phase_ != Phase::kHeader && phase_ != Phase::kUpload) return;
  last_transfer_ = Clock::now();
  if (!ok) {
    IsUnread(request_) ? EndUpload() : Fail(MalformedMessageError());
    return;
  }
  if (phase_ == Phase::kHeader) {
    TakeHeader();
  } else if (job_.parts) {
    storing_ = true;
    disk_->Post([call = shared_from_this()] { call->StoreChunk(); });
    return;
  } else {
    CountChunk(AppendChunk());
  }
  if (phase_ == Phase::kUpload) ReadNext();
}

void ReconstructCall::StoreChunk() {
  std::optional<CallError> error;
  if (upload_->bytes() == 0) error = CheckScratch(job_);
  if (!error) error = AppendChunk();
  const std::lock_guard lock(mutex_);
  storing_ = false;
  if (phase_ == Phase::kFinished) {
    upload_.reset();
    return;
  }
  last_transfer_ = Clock::now();
  CountChunk(error);
  if (phase_ == Phase::kUpload) ReadNext();
}

void ReconstructCall::ReadNext() {
  MarkUnread(&request_);
  StartRead(&request_);
}

void ReconstructCall::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  write_in_flight_ = false;
  last_transfer_ = Clock::now();
  if (!ok) {
    if (stop_reason_ == StopReason::kNone) stop_reason_ = StopReason::kClient;
    stop_.request_stop();
  }
  PumpWrites();
}

void ReconstructCall::OnCancel() { Stop(StopReason::kClient); }

void ReconstructCall::OnDone() {
  // The last reference may be this one.
  const std::shared_ptr<ReconstructCall> self = std::move(self_);
}

void ReconstructCall::Tick(Clock::time_point now) {
  StopReason reason = StopReason::kNone;
  {
    const std::lock_guard lock(mutex_);
    const bool receiving = phase_ == Phase::kHeader || phase_ == Phase::kUpload;
    const bool transferring = receiving || (phase_ == Phase::kDownload && write_in_flight_);
    if (transferring && now - last_transfer_ > core_->options.max_idle_time) {
      reason = StopReason::kIdle;
    } else if (phase_ == Phase::kUpload && UploadIsSlow(now)) {
      reason = StopReason::kUploadTime;  // a place is not held by a point a minute
    } else if (phase_ == Phase::kWork && now - work_begin_ > core_->options.max_job_time) {
      reason = StopReason::kJobTime;
    }
  }
  if (reason != StopReason::kNone) Stop(reason);
}

bool ReconstructCall::UploadIsSlow(Clock::time_point now) const {
  const double seconds = SecondsBetween(begin_, now);
  const bool trickles = now - begin_ > kUploadGrace &&
                        static_cast<double>(record_.bytes_in) < seconds * kSteadyBytesPerSecond;
  return trickles || now - begin_ > core_->options.max_job_time;
}

void ReconstructCall::Stop(StopReason reason) {
  const std::lock_guard lock(mutex_);
  if (stop_reason_ == StopReason::kNone) stop_reason_ = reason;
  stop_.request_stop();
  switch (phase_) {
    case Phase::kHeader:
    case Phase::kUpload:
      Fail(StopError(stop_reason_, core_->options));
      break;
    case Phase::kQueued:
      if (core_->pool.Withdraw(work_number_)) Fail(StopError(stop_reason_, core_->options));
      break;
    case Phase::kDownload:
      BreakOff(context_, StopError(stop_reason_, core_->options));
      break;
    case Phase::kWork:  // ends by itself within a second
    case Phase::kFinished:
      break;
  }
}

void ReconstructCall::TakeHeader() {
  if (!request_.has_header()) {
    Fail(OrderError("header", "the first message must hold the header"));
    return;
  }
  auto parsed = ParseHeader(request_.header(), core_->options);
  if (auto* error = std::get_if<CallError>(&parsed)) {
    Fail(*error);
    return;
  }
  if (const auto error = FitIntoMemory(core_->options, &std::get<JobRequest>(parsed))) {
    Fail(*error);
    return;
  }
  ticket_ = core_->pool.TryAdmit(caller_.client);
  if (!ticket_) {
    Fail(CallError(ErrorCause::kJobsLimit,
                   "as many jobs as this server takes of one client, or of all, are running and "
                   "waiting; try again later")
             .Limit(core_->options.max_concurrent_jobs + core_->options.max_queued_jobs)
             .RetryAfter(core_->pool.RetryDelay()));
    return;
  }
  job_ = std::get<JobRequest>(std::move(parsed));
  charge_ = core_->pool.TryCharge(job_.parts ? 0 : job_.size.bytes());
  if (!charge_) {
    Fail(CallError(ErrorCause::kJobsLimit,
                   "scans and surfaces that are on their way take the memory of this server; try "
                   "again later")
             .RetryAfter(core_->pool.RetryDelay()));
    return;
  }
  record_.points_announced = job_.size.points;
  if (job_.parts) {
    upload_.emplace(job_.size, job_.parts->scratch.path());
  } else {
    upload_.emplace(job_.size);
  }
  phase_ = Phase::kUpload;
}

std::optional<CallError> ReconstructCall::AppendChunk() {
  if (request_.has_points()) {
    return upload_->AppendPoints(std::move(*request_.mutable_points()->mutable_data()));
  }
  if (request_.has_triangles()) {
    return upload_->AppendTriangles(std::move(*request_.mutable_triangles()->mutable_data()));
  }
  if (request_.has_base()) {
    return upload_->AppendBase(std::move(*request_.mutable_base()->mutable_data()));
  }
  return OrderError("points",
                    "every message after the first must hold points or, after them, triangles or "
                    "the base surface");
}

void ReconstructCall::CountChunk(const std::optional<CallError>& error) {
  if (!job_.parts) core_->upload_bytes += upload_->bytes() - record_.bytes_in;
  record_.bytes_in = upload_->bytes();
  if (!error) return;
  record_.detail = DetailOf(upload_->written());
  Fail(*error);
}

// The client half-closed, or is gone: then OnCancel ends the call.
void ReconstructCall::EndUpload() {
  if (context_->IsCancelled()) return;
  if (phase_ == Phase::kHeader) {
    Fail(OrderError("header", "the stream was closed before a header came"));
    return;
  }
  if (const auto error = upload_->CheckComplete()) {
    Fail(*error);
    return;
  }
  upload_end_ = Clock::now();
  record_.upload_seconds = SecondsBetween(begin_, upload_end_);
  phase_ = Phase::kQueued;
  progress_.Queued(upload_end_);
  PumpWrites();
  work_number_ = core_->pool.Submit([call = shared_from_this()] { call->Work(); },
                                    {.client = caller_.client, .memory = EstimateMemory(job_)});
}

void ReconstructCall::Work() {
  {
    const std::lock_guard lock(mutex_);
    work_begin_ = Clock::now();
    record_.queue_seconds = SecondsBetween(upload_end_, work_begin_);
    phase_ = Phase::kWork;
  }
  absl::StatusOr<JobResult> result = absl::CancelledError();
  // Nobody else touches the upload any more.
  if (!stop_.stop_requested()) result = DoWork(upload_->Take());
  const std::lock_guard lock(mutex_);
  EndWork(std::move(result));
}

absl::StatusOr<JobResult> ReconstructCall::DoWork(ScanBytes scan) {
  RunContext context;
  context.stop = stop_.get_token();
  context.threads = job_.threads;
  context.seed = job_.seed;
  context.progress = [this](const Progress& progress) {
    const std::lock_guard lock(mutex_);
    progress_.Report(progress, Clock::now());
    PumpWrites();
  };
  return core_->work(job_, std::move(scan), context);
}

void ReconstructCall::EndWork(absl::StatusOr<JobResult> result) {
  record_.work_seconds = SecondsBetween(work_begin_, Clock::now());
  record_.peak_bytes = PeakBytes(result);
  record_.estimated_bytes = EstimateMemory(job_);
  upload_.reset();
  // Before the client learns of the end: it may call again at once.
  ticket_.reset();
  phase_ = Phase::kDownload;
  last_transfer_ = Clock::now();
  if (result.ok()) {
    record_.road = result->report.road();
    record_.stage_seconds = SecondsByStage(result->report);
    download_.emplace(std::move(result->encoded), std::move(result->report), job_.size.base_bytes);
    charge_->Set(download_->total_bytes());
  } else if (stop_reason_ != StopReason::kNone) {
    error_ = StopError(stop_reason_, core_->options);
  } else {
    const std::string& trace = caller_.trace_id;
    error_ = ErrorOfJob(result.status(), FieldAtFault(progress_.stage(), job_, result.status()),
                        trace.empty() ? "" : absl::StrCat("trace ", trace));
    record_.detail = DetailOf(result.status());
  }
  PumpWrites();
}

void ReconstructCall::PumpWrites() {
  if (write_in_flight_ || phase_ == Phase::kFinished) return;
  if (error_) {
    Fail(*error_);
    return;
  }
  if (stop_reason_ != StopReason::kNone) {
    if (phase_ == Phase::kDownload) Fail(StopError(stop_reason_, core_->options));
    return;
  }
  if (auto event = progress_.Pop()) {
    response_.Clear();
    *response_.mutable_progress() = *std::move(event);
  } else if (phase_ != Phase::kDownload) {
    return;
  } else if (!download_->Next(&response_)) {
    record_.bytes_out = download_->total_bytes() - job_.size.base_bytes;
    FinishOnce(grpc::Status::OK, absl::StatusCode::kOk);
    return;
  }
  write_in_flight_ = true;
  StartWrite(&response_);
}

void ReconstructCall::Fail(const CallError& error) {
  if (record_.detail.empty()) record_.detail = error.message;
  FinishOnce(GrpcStatus(error), error.code());
}

void ReconstructCall::FinishOnce(const grpc::Status& status, absl::StatusCode code) {
  if (phase_ == Phase::kFinished) return;
  phase_ = Phase::kFinished;
  record_.code = code;
  ticket_.reset();
  if (!storing_) upload_.reset();
  download_.reset();
  charge_.reset();
  Finish(status);
}

}  // namespace rilievo
