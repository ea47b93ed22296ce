#include "server/jobs/upload_scan_call.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "grpcpp/server_context.h"
#include "server/jobs/job_requests.h"
#include "server/jobs/request_checks.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/job_error.h"
#include "server/rpc/unread_message.h"

namespace rilievo {
namespace {

CallError ChunkViolation(const std::string& description,
                         ErrorCause reason = ErrorCause::kInvalidField) {
  return BadRequestError({{"chunk", description}}, reason);
}

CallError OrderError(const std::string& field, const std::string& description) {
  return BadRequestError({{field, description}}, ErrorCause::kMessageOrder);
}

CallError TooManyUploads(const ServerOptions& options) {
  return CallError(ErrorCause::kJobsLimit,
                   "as many scans as this server takes of one client, or of all, are being "
                   "uploaded; try again later")
      .Limit(options.max_uploads)
      .RetryAfter(std::chrono::seconds(2));
}

}  // namespace

UploadScanCall* UploadScanCall::Begin(JobsCore* core, Caller caller,
                                      v1::UploadScanResponse* response) {
  auto call = std::make_shared<UploadScanCall>(core, std::move(caller), response);
  UploadScanCall* reactor = call.get();
  const std::lock_guard lock(reactor->mutex_);
  core->service->live_calls.Enter(call, call->caller_.client);
  reactor->self_ = std::move(call);
  if (core->service->draining) {
    reactor->FinishOnce(GrpcStatus(ShutdownError()));
  } else if (!core->uploads.Take(reactor->caller_.client)) {
    reactor->FinishOnce(GrpcStatus(TooManyUploads(core->service->options)));
  } else {
    reactor->placed_ = true;
    reactor->ReadNext();
  }
  return reactor;
}

UploadScanCall::UploadScanCall(JobsCore* core, Caller caller, v1::UploadScanResponse* response)
    : core_(core),
      caller_(std::move(caller)),
      response_(response),
      begin_(Clock::now()),
      last_message_(begin_) {}

UploadScanCall::~UploadScanCall() {
  if (placed_) core_->uploads.Give(caller_.client);
  core_->service->live_calls.Leave(this);
}

void UploadScanCall::OnReadDone(bool ok) {
  const std::lock_guard lock(mutex_);
  if (finished_) return;
  busy_ = true;
  core_->bulk.Post([call = shared_from_this(), ok] {
    const std::optional<grpc::Status> end = call->Take(ok);
    const std::lock_guard done(call->mutex_);
    call->busy_ = false;
    call->last_message_ = Clock::now();
    if (ok) call->received_ += static_cast<int64_t>(call->request_.chunk().size());
    if (end) {
      call->FinishOnce(*end);
    } else if (call->stop_reason_ != StopReason::kNone) {
      call->FinishStopped();
    } else {
      call->ReadNext();
    }
  });
}

void UploadScanCall::ReadNext() {
  MarkUnread(&request_);
  StartRead(&request_);
}

void UploadScanCall::OnCancel() { Stop(StopReason::kClient); }

void UploadScanCall::OnDone() {
  // The last reference may be this one.
  const std::shared_ptr<UploadScanCall> self = std::move(self_);
}

void UploadScanCall::Tick(Clock::time_point now) {
  const ServerOptions& options = core_->service->options;
  bool late, idle;
  {
    const std::lock_guard lock(mutex_);
    const std::chrono::duration<double> age = now - begin_;
    late = age > options.max_job_time &&
           static_cast<double>(received_) < age.count() * kSteadyBytesPerSecond;
    idle = !busy_ && now - last_message_ > options.max_idle_time;
  }
  if (late) {
    Stop(StopReason::kUploadTime);
  } else if (idle) {
    Stop(StopReason::kIdle);
  }
}

grpc::Status UploadScanCall::StatusOfStop() const {
  CallError error = StopError(stop_reason_, core_->service->options);
  if (stop_reason_ == StopReason::kUploadTime) {
    error.message =
        "this stream took as long as the server gives to one that sends so little; go on in "
        "another from what GetUpload says";
    error.RetryAfter(std::chrono::seconds(1));
  }
  return GrpcStatus(error);
}

void UploadScanCall::Stop(StopReason reason) {
  const std::lock_guard lock(mutex_);
  if (stop_reason_ == StopReason::kNone) stop_reason_ = reason;
  if (!busy_) FinishStopped();
}

void UploadScanCall::FinishStopped() {
  // What is stored is not refused, though its client has not half-closed yet.
  FinishOnce(ended_ ? grpc::Status::OK : StatusOfStop());
}

void UploadScanCall::FinishOnce(const grpc::Status& status) {
  if (finished_) return;
  finished_ = true;
  Finish(status);
}

std::optional<grpc::Status> UploadScanCall::Take(bool ok) {
  std::optional<CallError> error;
  if (!ok && !IsUnread(request_)) {
    error = MalformedMessageError();
  } else if (!ok) {
    if (ended_) return grpc::Status::OK;
    error = CallError(ErrorCause::kScanIncomplete,
                      "the stream was closed before `end`; go on from what GetUpload says");
  } else if (ended_) {
    error = OrderError("end", "nothing may follow it");
  } else if (!writer_) {
    error = TakeHeader();
  } else if (request_.has_end()) {
    error = TakeEnd();
  } else {
    error = TakeChunk();
  }
  if (error) return GrpcStatus(*error);
  return std::nullopt;
}

std::optional<CallError> UploadScanCall::TakeHeader() {
  if (!request_.has_header()) return OrderError("header", "the first message must hold it");
  const v1::UploadHeader& header = request_.header();
  if (auto error = CheckUploadHeader(header, core_->service->options)) return error;
  total_bytes_ = header.total_bytes();
  name_ = UploadName(caller_, header.upload_id());
  const absl::Status room =
      core_->store->BeginUpload(caller_.owner, name_, static_cast<int64_t>(total_bytes_));
  if (!room.ok()) return ErrorOfStore(room);
  auto writer = core_->store->uploads().Continue(name_, static_cast<int64_t>(header.offset()));
  if (!writer.ok()) return ErrorOfStore(writer.status());
  writer_ = *std::move(writer);
  writer_->WhenMoved([core = core_] { core->bulk.Moved(); });
  return std::nullopt;
}

std::optional<CallError> UploadScanCall::TakeChunk() {
  if (request_.message_case() != v1::UploadScanRequest::kChunk) {
    return OrderError("chunk", "every message between header and end must hold one");
  }
  const std::string& bytes = request_.chunk();
  if (bytes.empty()) return ChunkViolation("0 bytes; send at least 1");
  if (bytes.size() > static_cast<size_t>(kMaxChunkBytes)) {
    return ChunkViolation(absl::StrCat(bytes.size(), " bytes; send at most ", kMaxChunkBytes),
                          ErrorCause::kLimitExceeded)
        .Limit(kMaxChunkBytes, bytes.size());
  }
  if (bytes.size() > total_bytes_ - static_cast<uint64_t>(writer_->size())) {
    return ChunkViolation(
        absl::StrCat("more than the ", total_bytes_, " bytes of header.total_bytes came"));
  }
  core_->service->metrics->CountReceived(static_cast<int64_t>(bytes.size()));
  const absl::Status written = writer_->Append(bytes);
  if (!written.ok()) return ErrorOfStore(written);
  return std::nullopt;
}

std::optional<CallError> UploadScanCall::TakeEnd() {
  std::string sha256;
  if (auto error = ReadEnd(request_.end(), &sha256)) return error;
  const absl::Status kept = core_->store->FinishUpload(
      caller_.owner, name_, static_cast<int64_t>(request_.end().total_bytes()), sha256,
      writer_.get());
  if (!kept.ok()) return ErrorOfStore(kept);
  response_->set_scan_id(sha256);
  response_->set_total_bytes(request_.end().total_bytes());
  ended_ = true;
  return std::nullopt;
}

}  // namespace rilievo
