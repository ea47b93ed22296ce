#include "server/jobs/stream_surface_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "grpcpp/server_context.h"
#include "server/jobs/request_checks.h"
#include "server/observability/server_log.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/job_error.h"

namespace rilievo {
namespace {

CallError NotSucceeded(v1::JobState state) {
  return {ErrorCause::kJobNotSucceeded,
          "the job has no surface: it is " + v1::JobState_Name(state)};
}

}  // namespace

CallError StreamSurfaceCall::Damaged(const absl::Status& status) const {
  // No file handle, a disk that fails, a store that is away: the bytes may be right the next time.
  if (absl::IsResourceExhausted(status) || absl::IsUnavailable(status)) {
    return ErrorOfStore(absl::UnavailableError(absl::StrCat("surface: ", status.message())));
  }
  LogMessage("store: the surface of job " + request_.job_id() + ": " +
             std::string(status.message()));
  return ErrorOfStore(DamagedSurface());
}

StreamSurfaceCall* StreamSurfaceCall::Begin(JobsCore* core, grpc::CallbackServerContext* context,
                                            Caller caller,
                                            const v1::StreamSurfaceRequest& request) {
  auto call = std::make_shared<StreamSurfaceCall>(core, context, std::move(caller), request);
  StreamSurfaceCall* reactor = call.get();
  const std::lock_guard lock(reactor->mutex_);
  core->service->live_calls.Enter(call, call->caller_.client);
  reactor->self_ = std::move(call);
  reactor->PostNext();
  return reactor;
}

StreamSurfaceCall::StreamSurfaceCall(JobsCore* core, grpc::CallbackServerContext* context,
                                     Caller caller, const v1::StreamSurfaceRequest& request)
    : core_(core),
      context_(context),
      caller_(std::move(caller)),
      request_(request),
      last_write_(Clock::now()) {}

StreamSurfaceCall::~StreamSurfaceCall() { core_->service->live_calls.Leave(this); }

void StreamSurfaceCall::PostNext() {
  busy_ = true;
  core_->bulk.Post([call = shared_from_this()] {
    const std::optional<grpc::Status> end = call->Next();
    const std::lock_guard lock(call->mutex_);
    call->busy_ = false;
    call->last_write_ = Clock::now();
    if (end) {
      call->FinishOnce(*end);
    } else if (call->stop_reason_ != StopReason::kNone) {
      call->FinishOnce(GrpcStatus(StopError(call->stop_reason_, call->core_->service->options)));
    } else {
      call->write_in_flight_ = true;
      call->StartWrite(&call->response_);
    }
  });
}

std::optional<grpc::Status> StreamSurfaceCall::Next() {
  if (!surface_) {
    if (const auto error = Open()) return GrpcStatus(*error);
  }
  const absl::StatusOr<bool> more = surface_->Next(&response_);
  if (!more.ok()) return GrpcStatus(Damaged(more.status()));
  if (!*more) return grpc::Status::OK;
  return std::nullopt;
}

std::optional<CallError> StreamSurfaceCall::Open() {
  const auto stored = core_->store->Get(caller_.owner, request_.job_id());
  if (!stored.ok()) return ErrorOfStore(stored.status());
  if (stored->job.state() != v1::JOB_STATE_SUCCEEDED) return NotSucceeded(stored->job.state());
  const auto first = FirstByte(request_, stored->job.surface());
  if (!first.ok()) return ErrorOfStore(first.status());
  // Once open it can be read to its end, though retention may remove it meanwhile.
  auto file = core_->store->blobs().Read(stored->surface, [this] { core_->bulk.Moved(); });
  if (!file.ok()) return Damaged(file.status());
  auto surface =
      StoredSurface::From(*std::move(file), stored->surface, stored->job.surface(), *first);
  if (absl::IsOutOfRange(surface.status())) return ErrorOfStore(surface.status());
  if (!surface.ok()) return Damaged(surface.status());
  surface_ = *std::move(surface);
  return std::nullopt;
}

void StreamSurfaceCall::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  write_in_flight_ = false;
  if (ok) {
    core_->service->metrics->CountSent(static_cast<int64_t>(response_.piece().data().size()));
  }
  if (!ok && stop_reason_ == StopReason::kNone) stop_reason_ = StopReason::kClient;
  if (stop_reason_ != StopReason::kNone) {
    FinishOnce(GrpcStatus(StopError(stop_reason_, core_->service->options)));
  } else if (!finished_) {
    PostNext();
  }
}

void StreamSurfaceCall::OnCancel() { Stop(StopReason::kClient); }

void StreamSurfaceCall::OnDone() {
  // The last reference may be this one.
  const std::shared_ptr<StreamSurfaceCall> self = std::move(self_);
}

void StreamSurfaceCall::Tick(Clock::time_point now) {
  bool idle;
  {
    const std::lock_guard lock(mutex_);
    idle = write_in_flight_ && now - last_write_ > core_->service->options.max_idle_time;
  }
  if (idle) Stop(StopReason::kIdle);
}

void StreamSurfaceCall::Stop(StopReason reason) {
  const std::lock_guard lock(mutex_);
  if (stop_reason_ == StopReason::kNone) stop_reason_ = reason;
  if (write_in_flight_) {
    BreakOff(context_, StopError(stop_reason_, core_->service->options));
  } else if (!busy_) {
    FinishOnce(GrpcStatus(StopError(stop_reason_, core_->service->options)));
  }
}

void StreamSurfaceCall::FinishOnce(const grpc::Status& status) {
  if (finished_) return;
  finished_ = true;
  Finish(status);
}

}  // namespace rilievo
