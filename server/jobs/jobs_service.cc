#include "server/jobs/jobs_service.h"

#include <algorithm>
#include <new>
#include <utility>

#include "core/base/status_macros.h"
#include "grpcpp/server_context.h"
#include "server/jobs/job_requests.h"
#include "server/jobs/stream_surface_call.h"
#include "server/jobs/upload_scan_call.h"
#include "server/jobs/watch_job_call.h"
#include "server/rpc/grpc_status.h"
#include "server/rpc/refusal.h"

namespace rilievo {
namespace {

grpc::Status NoStore() {
  return GrpcStatus({ErrorCause::kNoStore,
                     "this server keeps nothing: use Reconstruct, or a server with a store"});
}

CallError TooManyRequests() {
  return CallError(
             ErrorCause::kCallsLimit,
             "as many requests as this server takes of one client, or of all, are waiting for "
             "the disk; try again later")
      .RetryAfter(std::chrono::seconds(1));
}

}  // namespace

std::optional<grpc::Status> JobsService::Refuse(const grpc::CallbackServerContext& context,
                                                Caller* caller) const {
  if (const auto error = service_->door->Admit(context, caller)) return GrpcStatus(*error);
  if (!core_) return NoStore();
  return std::nullopt;
}

std::optional<grpc::Status> JobsService::RefuseStream(const grpc::CallbackServerContext& context,
                                                      Caller* caller) const {
  if (const auto error = service_->AdmitStream(context, caller)) return GrpcStatus(*error);
  if (!core_) return NoStore();
  return std::nullopt;
}

template <typename Request, typename Response>
grpc::ServerUnaryReactor* JobsService::OnDisk(grpc::CallbackServerContext* context,
                                              const Request* request, Response* response,
                                              Function<Request, Response> function) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  Caller caller;
  if (const auto refused = Refuse(*context, &caller)) {
    reactor->Finish(*refused);
    return reactor;
  }
  const auto bytes = std::max(kLeastRequestBytes, static_cast<int64_t>(request->SpaceUsedLong()));
  if (!core_->requests.Take(caller.client, bytes)) {
    reactor->Finish(GrpcStatus(TooManyRequests()));
    return reactor;
  }
  core_->disk.Post([=, core = core_.get(), caller = std::move(caller)] {
    grpc::Status status;
    try {
      status = function(core, caller, *request, response);
    } catch (const std::bad_alloc&) {
      status = GrpcStatus(TooManyRequests());
    }
    core->requests.Give(caller.client, bytes);
    reactor->Finish(status);
  });
  return reactor;
}

absl::StatusOr<std::unique_ptr<JobsService>> JobsService::Open(ServiceCore* core,
                                                               const OpenStore& open) {
  std::unique_ptr<JobsService> service(new JobsService(core));
  if (core->options.store.empty()) return service;
  RILIEVO_ASSIGN_OR_RETURN(auto store, open(core->options, SettingsOfStore(core->options)));
  service->core_ = std::make_unique<JobsCore>(core, std::move(store));
  RILIEVO_RETURN_IF_ERROR(service->core_->board.Restore());
  return service;
}

JobsService::~JobsService() = default;

std::chrono::steady_clock::duration JobsService::IdleTime() const {
  return core_ && core_->fleet ? core_->fleet->IdleTime() : std::chrono::steady_clock::duration(0);
}

int64_t JobsService::foreign_requests() const {
  return core_ ? core_->store->foreign_requests() : 0;
}

void JobsService::WatchRoom(std::function<void(bool room)> tell) {
  if (core_) core_->WatchRoom(std::move(tell));
}

void JobsService::BeginDrain() {
  if (core_) core_->board.BeginDrain();
}

grpc::ServerReadReactor<v1::UploadScanRequest>* JobsService::UploadScan(
    grpc::CallbackServerContext* context, v1::UploadScanResponse* response) {
  Caller caller;
  if (const auto refused = RefuseStream(*context, &caller)) {
    return new Refusal<grpc::ServerReadReactor<v1::UploadScanRequest>>(*refused);
  }
  return UploadScanCall::Begin(core_.get(), std::move(caller), response);
}

grpc::ServerUnaryReactor* JobsService::GetUpload(grpc::CallbackServerContext* context,
                                                 const v1::GetUploadRequest* request,
                                                 v1::GetUploadResponse* response) {
  return OnDisk(context, request, response, rilievo::GetUpload);
}

grpc::ServerUnaryReactor* JobsService::CreateJob(grpc::CallbackServerContext* context,
                                                 const v1::CreateJobRequest* request,
                                                 v1::CreateJobResponse* response) {
  return OnDisk(context, request, response, rilievo::CreateJob);
}

grpc::ServerUnaryReactor* JobsService::GetJob(grpc::CallbackServerContext* context,
                                              const v1::GetJobRequest* request,
                                              v1::GetJobResponse* response) {
  return OnDisk(context, request, response, rilievo::GetJob);
}

grpc::ServerUnaryReactor* JobsService::ListJobs(grpc::CallbackServerContext* context,
                                                const v1::ListJobsRequest* request,
                                                v1::ListJobsResponse* response) {
  return OnDisk(context, request, response, rilievo::ListJobs);
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* JobsService::WatchJob(
    grpc::CallbackServerContext* context, const v1::WatchJobRequest* request) {
  Caller caller;
  if (const auto refused = RefuseStream(*context, &caller)) {
    return new Refusal<grpc::ServerWriteReactor<v1::WatchJobResponse>>(*refused);
  }
  return WatchJobCall::Begin(core_.get(), std::move(caller), *request);
}

grpc::ServerWriteReactor<v1::StreamSurfaceResponse>* JobsService::StreamSurface(
    grpc::CallbackServerContext* context, const v1::StreamSurfaceRequest* request) {
  Caller caller;
  if (const auto refused = RefuseStream(*context, &caller)) {
    return new Refusal<grpc::ServerWriteReactor<v1::StreamSurfaceResponse>>(*refused);
  }
  return StreamSurfaceCall::Begin(core_.get(), context, std::move(caller), *request);
}

grpc::ServerUnaryReactor* JobsService::CancelJob(grpc::CallbackServerContext* context,
                                                 const v1::CancelJobRequest* request,
                                                 v1::CancelJobResponse* response) {
  return OnDisk(context, request, response, rilievo::CancelJob);
}

grpc::ServerUnaryReactor* JobsService::DeleteJob(grpc::CallbackServerContext* context,
                                                 const v1::DeleteJobRequest* request,
                                                 v1::DeleteJobResponse* response) {
  return OnDisk(context, request, response, rilievo::DeleteJob);
}

grpc::ServerUnaryReactor* JobsService::DeleteScan(grpc::CallbackServerContext* context,
                                                  const v1::DeleteScanRequest* request,
                                                  v1::DeleteScanResponse* response) {
  return OnDisk(context, request, response, rilievo::DeleteScan);
}

}  // namespace rilievo
