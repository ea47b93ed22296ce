// One stream of WatchJob.
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "grpcpp/support/server_callback.h"
#include "rilievo/v1/jobs.pb.h"
#include "server/auth/caller.h"
#include "server/jobs/job_events.h"
#include "server/jobs/jobs_core.h"
#include "server/rpc/live_calls.h"

namespace rilievo {

// A reactor that takes the next event when the write before is done: one event a stream is held,
// however slowly it is read.
class WatchJobCall final : public grpc::ServerWriteReactor<v1::WatchJobResponse>,
                           public LiveCall,
                           public std::enable_shared_from_this<WatchJobCall> {
 public:
  // The reactor gRPC asks for; owns itself until OnDone().
  static WatchJobCall* Begin(JobsCore* core, Caller caller, const v1::WatchJobRequest& request);

  WatchJobCall(JobsCore* core, Caller caller, const v1::WatchJobRequest& request);
  ~WatchJobCall() override;

  void OnWriteDone(bool ok) override;
  void OnCancel() override;
  void OnDone() override;

  // Nothing may happen for hours: no limit of time.
  void Tick(Clock::time_point /*now*/) override {}
  void Stop(StopReason reason) override;

 private:
  // On a disk thread.
  void FindJob();
  // On a disk thread, so that whoever pushes an event never waits for gRPC.
  void Wake();

  // With mutex_ held.
  void Pump();
  void FinishOnce(const grpc::Status& status);

  JobsCore* const core_;
  const Caller caller_;
  const std::string job_id_;
  std::shared_ptr<WatchJobCall> self_;  // until OnDone

  std::mutex mutex_;
  std::shared_ptr<JobEvents> events_;
  uint64_t sequence_;  // of the latest event written
  v1::WatchJobResponse response_;
  bool write_in_flight_ = false;
  bool finished_ = false;
  StopReason stop_reason_ = StopReason::kNone;
};

}  // namespace rilievo
