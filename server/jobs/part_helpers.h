// Large jobs that others lead and whose parts this machine does too.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/jobs/job_board.h"
#include "server/jobs/job_run.h"
#include "server/rpc/service_core.h"
#include "server/store/job_store.h"

namespace rilievo {

// Thread-safe.
class PartHelpers {
 public:
  // All outlive it.
  PartHelpers(ServiceCore* core, JobStore* store, const JobBoard* board)
      : core_(core), store_(store), board_(board) {}
  // Stops, and waits for the work to end.
  ~PartHelpers();

  PartHelpers(const PartHelpers&) = delete;
  PartHelpers& operator=(const PartHelpers&) = delete;

  // Begins to help with a job whose parts wait for somebody, as work of the job pool; false when
  // there is none. Waits for the store.
  bool Help(const ClaimDemand& demand);

  // Stops with jobs that nobody waits for any longer. Waits for the store.
  void Look();

  int size() const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Helped {
    std::shared_ptr<JobRun> run;
    uint64_t work_number = 0;
  };

  void Work(const std::string& job_id, const std::shared_ptr<JobRun>& run);

  ServiceCore* const core_;
  JobStore* const store_;
  const JobBoard* const board_;
  mutable std::mutex mutex_;
  std::condition_variable idle_;
  std::map<std::string, Helped> helped_;           // by job
  std::map<std::string, Clock::time_point> left_;  // that could not be helped; until when
};

}  // namespace rilievo
