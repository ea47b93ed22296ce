// One stream of StreamSurface.
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "grpcpp/support/server_callback.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/auth/caller.h"
#include "server/conversion/call_error.h"
#include "server/jobs/jobs_core.h"
#include "server/jobs/stored_surface.h"
#include "server/rpc/live_calls.h"

namespace rilievo {

// A reactor: a disk thread reads each piece when the one before is written. A stream holds one
// piece, however slowly it is read.
class StreamSurfaceCall final : public grpc::ServerWriteReactor<v1::StreamSurfaceResponse>,
                                public LiveCall,
                                public std::enable_shared_from_this<StreamSurfaceCall> {
 public:
  // The reactor gRPC asks for; owns itself until OnDone().
  static StreamSurfaceCall* Begin(JobsCore* core, grpc::CallbackServerContext* context,
                                  Caller caller, const v1::StreamSurfaceRequest& request);

  StreamSurfaceCall(JobsCore* core, grpc::CallbackServerContext* context, Caller caller,
                    const v1::StreamSurfaceRequest& request);
  ~StreamSurfaceCall() override;

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  void Tick(Clock::time_point now) override;
  void Stop(StopReason reason) override;

 private:
  // Hands the next step to a disk thread. With mutex_ held.
  void PostNext();
  // On a disk thread: the status to end with, or response_ filled.
  std::optional<grpc::Status> Next();
  std::optional<CallError> Open();
  CallError Damaged(const absl::Status& status) const;

  // With mutex_ held.
  void FinishOnce(const grpc::Status& status);

  JobsCore* const core_;
  grpc::CallbackServerContext* const context_;
  const Caller caller_;
  const v1::StreamSurfaceRequest request_;
  std::shared_ptr<StreamSurfaceCall> self_;  // until OnDone

  std::optional<StoredSurface> surface_;  // the disk thread's
  v1::StreamSurfaceResponse response_;    // the disk thread's, then of the write in flight

  std::mutex mutex_;
  bool busy_ = false;  // a disk thread is at work
  bool write_in_flight_ = false;
  bool finished_ = false;
  StopReason stop_reason_ = StopReason::kNone;
  Clock::time_point last_write_;
};

}  // namespace rilievo
