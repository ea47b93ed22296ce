// The jobs of a shared store that are not finished: who works on them, and until when.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/database.h"
#include "server/store/job_record.h"

namespace rilievo {

// Workers renew each second; a stall of the network or of the database costs no work.
inline constexpr char kLease[] = "interval '15 seconds'";

// A job that a worker has taken. What a worker writes with an older number is refused, and with
// that of another worker: numbers come again where a database was restored from a backup.
struct JobClaim {
  std::string job_id;
  int64_t number = 0;
  std::string worker;
  int64_t memory = 0;  // that the job may need, by estimate, bytes
};

// What a worker takes.
struct ClaimDemand {
  std::string worker;  // its name, nobody else's
  int64_t memory = 0;  // that its jobs may need together, bytes
  bool idle = false;   // it works on nothing else
};

// Rows of the table `queue` of PostgreSQL. A claim ends when its lease is over, by the database's
// clock, and a worker that renews its own notices; no lease is over for a lease's length after
// the postmaster started. Turns go round the clients: first comes whose latest job was taken
// longest ago.
class JobQueue {
 public:
  explicit JobQueue(Database* database) : database_(database) {}

  absl::Status Insert(const StoredJob& stored);
  // Finished, removed or damaged.
  absl::Status Remove(const std::string& job_id);

  // In a transaction of its own, beside others. Nothing only when every job that waits and fits is
  // being claimed by somebody else. Jobs that may take their machine along (`suspect`) come when
  // nothing else waits, to a worker that is idle and has the memory. One that needs more memory
  // than any worker has goes to an idle one of those that have most.
  absl::StatusOr<std::optional<JobClaim>> Claim(const ClaimDemand& demand);

  // Within a transaction: nobody else changes the job, or takes it, until the end of that.
  absl::Status Lock(const std::string& job_id);
  // Gives a job back, as one to be taken with others or not; `last`: behind all that wait.
  absl::Status Release(const JobClaim& claim, bool suspect, bool last);

  // In a transaction of its own: leases of all claims of a worker go on; these claims. Then jobs
  // whose lease is over are free, as suspects where one more unclean end makes them that.
  // `freed`: set to their number.
  absl::StatusOr<std::vector<JobClaim>> Renew(const ClaimDemand& worker, int64_t* freed);

  // The latest event of a job, for whoever watches it elsewhere; empty when there is none. Tell():
  // in a transaction of its own.
  absl::Status Tell(const JobClaim& claim, const std::string& event);
  absl::StatusOr<std::string> LatestEvent(const std::string& job_id);

  struct Counts {
    int64_t all = 0, of_client = 0;
    int64_t waiting = 0;  // of all, those that nobody works on
    int64_t workers = 0;  // that were heard of lately
  };
  absl::StatusOr<Counts> Count(const std::string& client);

  // Forgets clients without jobs and workers that are gone.
  absl::Status Clean();

 private:
  // The job of that number, which a statement selects and locks.
  absl::StatusOr<std::optional<JobClaim>> Take(const std::string& number, const ClaimDemand& demand,
                                               int64_t heads);
  // Whether there is one that this worker may take.
  absl::StatusOr<bool> Waits(const ClaimDemand& demand);
  absl::StatusOr<std::vector<JobClaim>> RenewLeases(const std::string& worker);
  absl::StatusOr<int64_t> FreeLost();

  Database* const database_;
};

}  // namespace rilievo
