// rilievo.v1.JobsService over a store, or its refusal where there is none.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "grpcpp/support/server_callback.h"
#include "rilievo/v1/jobs.grpc.pb.h"
#include "server/auth/caller.h"
#include "server/jobs/jobs_core.h"
#include "server/jobs/open_store.h"
#include "server/rpc/service_core.h"

namespace rilievo {

class JobsService final : public v1::JobsService::CallbackService {
 public:
  // Opens core->options.store by `open`, unless that is empty, and takes up what it left
  // unfinished. `core` outlives this object.
  static absl::StatusOr<std::unique_ptr<JobsService>> Open(ServiceCore* core,
                                                           const OpenStore& open = OpenFolder);

  // The gRPC server is gone. Stops what runs; a later server goes on with it.
  ~JobsService() override;

  // Heartbeats of the disk threads; null without a store.
  const Heartbeat* disk_heart() const { return core_ ? &core_->disk.heart() : nullptr; }
  const Heartbeat* bulk_heart() const { return core_ ? &core_->bulk.heart() : nullptr; }

  // Of a server that shares its store: for how long there was nothing to work on; else 0.
  std::chrono::steady_clock::duration IdleTime() const;

  // How many requests so far were for a job of another owner.
  int64_t foreign_requests() const;

  // As JobsCore's; never called without a store.
  void WatchRoom(std::function<void(bool room)> tell);

  // No more jobs begin, and watchers are sent elsewhere.
  void BeginDrain();

  grpc::ServerReadReactor<v1::UploadScanRequest>* UploadScan(
      grpc::CallbackServerContext* context, v1::UploadScanResponse* response) override;
  grpc::ServerUnaryReactor* GetUpload(grpc::CallbackServerContext* context,
                                      const v1::GetUploadRequest* request,
                                      v1::GetUploadResponse* response) override;
  grpc::ServerUnaryReactor* CreateJob(grpc::CallbackServerContext* context,
                                      const v1::CreateJobRequest* request,
                                      v1::CreateJobResponse* response) override;
  grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context,
                                   const v1::GetJobRequest* request,
                                   v1::GetJobResponse* response) override;
  grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context,
                                     const v1::ListJobsRequest* request,
                                     v1::ListJobsResponse* response) override;
  grpc::ServerWriteReactor<v1::WatchJobResponse>* WatchJob(
      grpc::CallbackServerContext* context, const v1::WatchJobRequest* request) override;
  grpc::ServerWriteReactor<v1::StreamSurfaceResponse>* StreamSurface(
      grpc::CallbackServerContext* context, const v1::StreamSurfaceRequest* request) override;
  grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context,
                                      const v1::CancelJobRequest* request,
                                      v1::CancelJobResponse* response) override;
  grpc::ServerUnaryReactor* DeleteJob(grpc::CallbackServerContext* context,
                                      const v1::DeleteJobRequest* request,
                                      v1::DeleteJobResponse* response) override;
  grpc::ServerUnaryReactor* DeleteScan(grpc::CallbackServerContext* context,
                                       const v1::DeleteScanRequest* request,
                                       v1::DeleteScanResponse* response) override;

 private:
  template <typename Request, typename Response>
  using Function = grpc::Status (*)(JobsCore*, const Caller&, const Request&, Response*);

  explicit JobsService(ServiceCore* service) : service_(service) {}

  // Sets the caller, or gives the status to end the call with.
  std::optional<grpc::Status> Refuse(const grpc::CallbackServerContext& context,
                                     Caller* caller) const;
  std::optional<grpc::Status> RefuseStream(const grpc::CallbackServerContext& context,
                                           Caller* caller) const;

  // `function` of job_requests.h, called on a disk thread. What gRPC gave lives until Finish().
  template <typename Request, typename Response>
  grpc::ServerUnaryReactor* OnDisk(grpc::CallbackServerContext* context, const Request* request,
                                   Response* response, Function<Request, Response> function);

  ServiceCore* const service_;
  std::unique_ptr<JobsCore> core_;  // none without a store
};

}  // namespace rilievo
