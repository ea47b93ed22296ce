// A server as part of a fleet: it claims jobs of the store that all servers share, and renews its
// leases on them while it works.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include "server/jobs/job_board.h"
#include "server/jobs/part_helpers.h"
#include "server/rpc/service_core.h"
#include "server/store/job_store.h"

namespace rilievo {

// Where no job waits it helps with the parts of large ones. One thread of its own. It never takes
// more than the job pool begins at once; the rest is left to others.
class FleetMember {
 public:
  // `works`: else it only follows what is watched here.
  FleetMember(ServiceCore* core, JobStore* store, JobBoard* board, bool works);
  ~FleetMember();

  // There may be something to do.
  void Wake();

  // For how long nothing of the fleet has waited or been worked on here, as far as is known.
  std::chrono::steady_clock::duration IdleTime() const;

 private:
  void WorkUntil(const std::stop_token& stop);
  void Claim();
  // Tells the metrics of all that share the store.
  void LookAround();
  // Leases go on; what was lost is noticed.
  bool Renew();
  ClaimDemand Demand() const;
  // Tells the log when the store goes away and when it is back.
  bool Note(const absl::Status& status);

  ServiceCore* const core_;
  JobStore* const store_;
  JobBoard* const board_;
  const bool works_;
  const std::string name_;
  bool away_ = false;  // the store; of the thread alone
  mutable std::mutex mutex_;
  std::chrono::steady_clock::time_point busy_;  // when something was there last
  bool woken_ = false;
  std::condition_variable_any wake_;
  PartHelpers helpers_;
  std::jthread thread_;
};

}  // namespace rilievo
