// One stream of UploadScan.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "grpcpp/support/server_callback.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/auth/caller.h"
#include "server/conversion/call_error.h"
#include "server/jobs/jobs_core.h"
#include "server/rpc/live_calls.h"

namespace rilievo {

// A reactor: each message is handed to the disk threads, and the next is read when it is stored. So
// a stream holds one message, however fast its client sends.
class UploadScanCall final : public grpc::ServerReadReactor<v1::UploadScanRequest>,
                             public LiveCall,
                             public std::enable_shared_from_this<UploadScanCall> {
 public:
  // The reactor gRPC asks for; owns itself until OnDone().
  static UploadScanCall* Begin(JobsCore* core, Caller caller, v1::UploadScanResponse* response);

  UploadScanCall(JobsCore* core, Caller caller, v1::UploadScanResponse* response);
  ~UploadScanCall() override;

  void OnReadDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void Tick(Clock::time_point now) override;
  void Stop(StopReason reason) override;

 private:
  // On a disk thread. Nothing when the next message is due.
  std::optional<grpc::Status> Take(bool ok);
  std::optional<CallError> TakeHeader();
  std::optional<CallError> TakeChunk();
  std::optional<CallError> TakeEnd();

  grpc::Status StatusOfStop() const;

  // With mutex_ held.
  void ReadNext();
  void FinishStopped();
  void FinishOnce(const grpc::Status& status);

  JobsCore* const core_;
  const Caller caller_;
  v1::UploadScanResponse* const response_;
  std::shared_ptr<UploadScanCall> self_;  // until OnDone

  v1::UploadScanRequest request_;         // of the read in flight, then of the disk thread
  std::unique_ptr<UploadWriter> writer_;  // the disk thread's
  std::string name_;                      // of the upload in the store
  uint64_t total_bytes_ = 0;
  bool ended_ = false;   // the scan is stored
  bool placed_ = false;  // among the uploads
  const Clock::time_point begin_;

  std::mutex mutex_;
  bool busy_ = false;  // a disk thread is at work
  bool finished_ = false;
  int64_t received_ = 0;  // bytes of chunks
  StopReason stop_reason_ = StopReason::kNone;
  Clock::time_point last_message_;
};

}  // namespace rilievo
