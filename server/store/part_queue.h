// The parts of large jobs of a shared store: who does which, and what came of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/paging/shared_parts.h"
#include "server/store/database.h"

namespace rilievo {

// Who works on the parts of a job: the worker that has the job's claim and leads, or one that
// helps.
struct PartWorker {
  std::string job_id, owner;
  std::string worker;
  int64_t claim = 0;   // of the job; 0: helps
  int64_t memory = 0;  // that its jobs may need together, bytes
  // What parts depend on besides the job: version and limits of the worker.
  std::string recipe = {};
};

// Of a worker where it helps. Leases and claims of a job that it comes to lead meanwhile are
// others.
std::string NameOfHelper(const std::string& worker);

// A part that a worker has taken. What it writes with an older number is refused.
struct PartClaim {
  std::string job_id, owner;
  PartStep step = PartStep::kCoarse;
  int part = 0;
  int64_t number = 0;
  std::string worker;
};

// Rows of the table `job_parts` of PostgreSQL. Leases are those of JobQueue.
class PartQueue {
 public:
  explicit PartQueue(Database* database) : database_(database) {}

  struct Turn {
    std::optional<PartClaim> claim;  // unset: others do what is left, or nothing is
    int done = 0;
    // Of one who helps and has nothing to do: it keeps its place from a job that it could work on.
    bool job_waits = false;
    // Once all are done, and only once: what this worker has found of the step was wrong.
    bool was_wrong = false;
  };
  // The next of the step's `count` parts, in a transaction of its own. One part in `checked_share`
  // of a step that has several is done twice, by another worker where there is one. Those who help
  // never compare with what they have found themselves, and leave a part that was taken kMostTries
  // times to the worker that leads.
  // FAILED_PRECONDITION when the job is finished, was removed, or has another leader or parts of
  // another recipe, or nothing is open to one who helps and nobody leads; INTERNAL when other
  // workers have cut the step into another number of parts.
  absl::StatusOr<Turn> Take(const PartWorker& worker, PartStep step, int count,
                            int64_t checked_share);

  enum class Kept {
    kFirst,      // `result` is what is kept of it
    kSame,       // it was there, and is the same
    kDoubtful,   // something else was there: it is to be done a third time
    kCorrected,  // it was done twice with different results; `result` is kept from now on
    kOthers,     // the claim is no longer in force: somebody else does it
  };
  struct Finished {
    Kept kept = Kept::kFirst;
    std::string wrong_by = {};  // where two of three results are the same: whose is not
    std::string wrong = {};     // and the blob, where it is corrected
  };
  // Within a transaction. INTERNAL when three different results came of the part, and when one
  // worker has found the same again where another one differs: that tells nothing.
  absl::StatusOr<Finished> Finish(const PartClaim& claim, const std::string& result);

  // The blob of a part that is done; empty when there is none.
  absl::StatusOr<std::string> Result(const std::string& job_id, PartStep step, int part);

  // Within a transaction: a part whose blob is lost is to be done again; false when it has another.
  absl::StatusOr<bool> Reopen(const std::string& job_id, PartStep step, int part,
                              const std::string& result);

  // Gives back what a worker has taken of a job. In a transaction of its own.
  absl::Status Release(const std::string& job_id, const std::string& worker);

  // Their leases go on; parts whose lease is over are free. In a transaction of its own.
  absl::Status Renew(const std::vector<PartClaim>& held);

  // Jobs with parts that wait for this worker to help, oldest first: of those that another one
  // leads, that need no more memory, by the same recipe.
  absl::StatusOr<std::vector<std::string>> JobsToHelp(const std::string& worker, int64_t memory,
                                                      const std::string& recipe);

  // Whether the job is not finished.
  absl::StatusOr<bool> Waits(const std::string& job_id);

 private:
  absl::StatusOr<bool> IsInForce(const PartWorker& worker);
  absl::Status CheckRecipe(const PartWorker& worker);
  // Of one who helps: or they would wait for each other, and keep their places from the job.
  absl::Status CheckLed(const PartWorker& worker);
  // One that suits it; `suspect`: of those too that may have ended their workers.
  absl::StatusOr<bool> JobWaits(const PartWorker& worker, bool suspect);
  absl::StatusOr<bool> IsOfUseElsewhere(const PartWorker& worker);
  absl::StatusOr<bool> WasWrong(const PartWorker& worker, PartStep step);
  // How many parts the step has, after they were made where there were none.
  absl::StatusOr<int> Make(const PartWorker& worker, PartStep step, int count,
                           int64_t checked_share, int* done);

  Database* const database_;
};

}  // namespace rilievo
