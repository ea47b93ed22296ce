// One attempt at a kept job.
#pragma once

#include <memory>
#include <mutex>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "server/jobs/job_events.h"
#include "server/jobs/parts_in_store.h"
#include "server/observability/job_log.h"
#include "server/rpc/live_calls.h"
#include "server/rpc/progress_queue.h"
#include "server/rpc/service_core.h"
#include "server/store/job_store.h"

namespace rilievo {

// How an attempt ended, and the job as it is to be kept then.
struct JobOutcome {
  enum class Kind {
    kFinished,   // `job` has its last state
    kKilled,     // the worker was killed from outside: worth another attempt
    kUntried,    // this machine could not work on it: no attempt at all
    kAbandoned,  // the server stops, or the job was cancelled meanwhile: nothing is to be kept
  };
  Kind kind = Kind::kAbandoned;
  StoredJob job;
  std::vector<std::vector<uint8_t>> surface;  // when it succeeded
  bool got_on = false;                        // parts were done that no later attempt repeats
};

class JobRun final : public LiveCall {
 public:
  // `stored`: as RUNNING. Without `events` nobody watches.
  JobRun(ServiceCore* core, JobStore* store, StoredJob stored, std::shared_ptr<JobEvents> events);

  const StoredJob& stored() const { return stored_; }

  // The work, on the thread that calls.
  JobOutcome Work();

  // Instead: does parts of a job that another worker leads, whose claim `stored` does not have.
  absl::Status Help();

  // Keeps a finished outcome. OK when it is on disk; FAILED_PRECONDITION when the job was finished
  // or removed meanwhile.
  static absl::Status Keep(const JobOutcome& outcome, JobStore* store);

  bool stopped() const;

  void Tick(Clock::time_point now) override;
  void Stop(StopReason reason) override;

 private:
  absl::StatusOr<JobResult> Reconstruct(JobRequest* job);
  // Why it was stopped, if it was; from now on it takes as long as it takes.
  StopReason EndWork();
  // What the store cannot give just now, here: no job begins for a moment.
  absl::Status NotToBeHad(const absl::Status& status);
  void Log(const JobOutcome& outcome, const JobRequest& request,
           const absl::StatusOr<JobResult>& result, double seconds) const;

  ServiceCore* const core_;
  JobStore* const store_;
  const StoredJob stored_;
  const std::shared_ptr<JobEvents> events_;
  const uint64_t number_;  // in the log
  const Clock::time_point begin_;
  ProgressQueue progress_;
  std::shared_ptr<PartsInStore> parts_;  // of a large job of a fleet; else null
  mutable std::mutex mutex_;
  StopReason stop_reason_ = StopReason::kNone;
  bool working_ = true;
  std::stop_source stop_;
};

// Of now.
void SetTime(google::protobuf::Timestamp* time);

}  // namespace rilievo
