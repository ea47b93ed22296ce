// One call of Reconstruct, from its header to its summary.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "grpcpp/support/server_callback.h"
#include "rilievo/v1/reconstruction.grpc.pb.h"
#include "server/auth/caller.h"
#include "server/conversion/call_error.h"
#include "server/conversion/incoming_scan.h"
#include "server/conversion/job_request.h"
#include "server/jobs/disk_pool.h"
#include "server/observability/job_log.h"
#include "server/rpc/job_pool.h"
#include "server/rpc/live_calls.h"
#include "server/rpc/progress_queue.h"
#include "server/rpc/service_core.h"
#include "server/surface_download.h"

namespace rilievo {

// A reactor: gRPC's threads bring messages in and take them out and do no work of ours; the work
// runs on the job pool. One read and one write are in flight at most. Finish() is called once, and
// never while the work runs, so the object lives until both the call and the work are over.
class ReconstructCall final
    : public grpc::ServerBidiReactor<v1::ReconstructRequest, v1::ReconstructResponse>,
      public LiveCall,
      public std::enable_shared_from_this<ReconstructCall> {
 public:
  // The reactor gRPC asks for; owns itself until OnDone().
  // `disk`: of a server with a scratch folder, else null.
  static ReconstructCall* Begin(ServiceCore* core, DiskPool* disk,
                                grpc::CallbackServerContext* context, Caller caller);

  ReconstructCall(ServiceCore* core, DiskPool* disk, grpc::CallbackServerContext* context,
                  Caller caller);
  ~ReconstructCall() override;

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void Tick(Clock::time_point now) override;
  void Stop(StopReason reason) override;

 private:
  enum class Phase { kHeader, kUpload, kQueued, kWork, kDownload, kFinished };

  // All of these with mutex_ held.
  void ReadNext();
  void TakeHeader();
  void CountChunk(const std::optional<CallError>& error);
  void EndUpload();
  void PumpWrites();
  bool UploadIsSlow(Clock::time_point now) const;
  void EndWork(absl::StatusOr<JobResult> result);
  void Fail(const CallError& error);
  void FinishOnce(const grpc::Status& status, absl::StatusCode code);

  // Of the message in `request_`, which like `upload_` is this function's until it returns.
  std::optional<CallError> AppendChunk();

  // On a disk thread, mutex_ free: the same for points that go to disk.
  void StoreChunk();

  // On a thread of the pool, mutex_ free.
  void Work();
  absl::StatusOr<JobResult> DoWork(ScanBytes scan);

  ServiceCore* const core_;
  DiskPool* const disk_;
  grpc::CallbackServerContext* const context_;
  const Caller caller_;
  std::shared_ptr<ReconstructCall> self_;  // until OnDone

  std::mutex mutex_;
  Phase phase_ = Phase::kHeader;
  StopReason stop_reason_ = StopReason::kNone;
  std::stop_source stop_;
  v1::ReconstructRequest request_;    // of the read in flight
  v1::ReconstructResponse response_;  // of the write in flight
  bool write_in_flight_ = false;
  bool storing_ = false;            // a disk thread has `request_` and `upload_`
  std::optional<CallError> error_;  // sent once no write is in flight
  std::optional<JobPool::Ticket> ticket_;
  std::optional<JobPool::Charge> charge_;  // of the scan, then of the surface
  uint64_t work_number_ = 0;
  JobRequest job_;
  std::optional<IncomingScan> upload_;
  ProgressQueue progress_;
  std::optional<SurfaceDownload> download_;
  JobRecord record_;
  Clock::time_point begin_, upload_end_{}, work_begin_{}, last_transfer_;
};

}  // namespace rilievo
