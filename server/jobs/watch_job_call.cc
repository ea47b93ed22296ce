#include "server/jobs/watch_job_call.h"

#include <utility>

#include "grpcpp/server_context.h"
#include "server/jobs/request_checks.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/job_error.h"

namespace rilievo {
namespace {

CallError ErrorOfEnd(const absl::Status& reason) {
  CallError error = ErrorOfStore(reason);
  if (error.reason == ErrorCause::kTryAgain) error.RetryAfter(std::chrono::milliseconds(100));
  return error;
}

}  // namespace

WatchJobCall* WatchJobCall::Begin(JobsCore* core, Caller caller,
                                  const v1::WatchJobRequest& request) {
  auto call = std::make_shared<WatchJobCall>(core, std::move(caller), request);
  WatchJobCall* reactor = call.get();
  core->service->live_calls.Enter(call, call->caller_.client);
  reactor->self_ = call;
  core->disk.Post([found = std::move(call)] { found->FindJob(); });
  return reactor;
}

WatchJobCall::WatchJobCall(JobsCore* core, Caller caller, const v1::WatchJobRequest& request)
    : core_(core),
      caller_(std::move(caller)),
      job_id_(request.job_id()),
      sequence_(request.after_sequence()) {}

WatchJobCall::~WatchJobCall() { core_->service->live_calls.Leave(this); }

void WatchJobCall::FindJob() {
  const auto stored = core_->store->Get(caller_.owner, job_id_);
  std::shared_ptr<JobEvents> events;
  if (stored.ok()) {
    events = core_->board.EventsOf(job_id_);
    if (!events) {
      // It ended, perhaps just now; or it was created just now and is not in the queue yet.
      const auto again = core_->store->Get(caller_.owner, job_id_);
      const v1::Job& job = again.ok() ? again->job : stored->job;
      if (!IsFinished(job.state()) && core_->store->shared()) {
        events = core_->board.EventsElsewhere(caller_.owner, job);
      } else {
        events = std::make_shared<JobEvents>(job);
        if (!IsFinished(job.state())) {
          events->Close(
              StatusOf({ErrorCause::kTryAgain, "the job is not in the queue yet; watch it again"}));
        }
      }
    }
  }
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  if (!stored.ok()) {
    FinishOnce(GrpcStatus(ErrorOfStore(stored.status())));
    return;
  }
  events_ = std::move(events);
  // Strong references would keep a call alive that gRPC has done with.
  events_->Watch(this, [core = core_, weak = weak_from_this()] {
    core->disk.Post([weak] {
      if (const auto call = weak.lock()) call->Wake();
    });
  });
  Pump();
}

void WatchJobCall::Wake() {
  const std::lock_guard lock(mutex_);
  Pump();
}

void WatchJobCall::Pump() {
  if (finished_ || write_in_flight_ || !events_) return;
  if (stop_reason_ != StopReason::kNone) {
    FinishOnce(GrpcStatus(StopError(stop_reason_, core_->service->options)));
    return;
  }
  if (auto event = events_->After(sequence_)) {
    sequence_ = event->sequence();
    *response_.mutable_event() = *std::move(event);
    write_in_flight_ = true;
    StartWrite(&response_);
  } else if (const auto end = events_->EndAfter(sequence_)) {
    FinishOnce(end->ok() ? grpc::Status::OK : GrpcStatus(ErrorOfEnd(*end)));
  }
}

void WatchJobCall::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  write_in_flight_ = false;
  if (!ok && stop_reason_ == StopReason::kNone) stop_reason_ = StopReason::kClient;
  Pump();
}

void WatchJobCall::OnCancel() { Stop(StopReason::kClient); }

void WatchJobCall::Stop(StopReason reason) {
  const std::lock_guard lock(mutex_);
  if (stop_reason_ == StopReason::kNone) stop_reason_ = reason;
  // A write that a cancelled client never takes is given back by gRPC; then Pump() finishes.
  if (!write_in_flight_) FinishOnce(GrpcStatus(StopError(stop_reason_, core_->service->options)));
}

void WatchJobCall::OnDone() {
  std::shared_ptr<JobEvents> events;
  {
    const std::lock_guard lock(mutex_);
    events = std::move(events_);
  }
  if (events) events->Unwatch(this);
  // The last reference may be this one.
  const std::shared_ptr<WatchJobCall> self = std::move(self_);
}

void WatchJobCall::FinishOnce(const grpc::Status& status) {
  if (finished_) return;
  finished_ = true;
  Finish(status);
}

}  // namespace rilievo
