// Each job in a process of its own, so that none can hurt the server or another.
#pragma once

#include <cstdint>
#include <string>

#include "server/worker/job_work.h"

namespace rilievo {

struct WorkerSettings {
  std::string program;            // of rilievo-worker
  int64_t memory_bytes = 0;       // see WorkerLimits
  int64_t processor_seconds = 0;  // for each thread of the job
};

// Same result as InThisProcess(Reconstruct). Beside its errors: RESOURCE_EXHAUSTED when the job
// needs more memory than it may have, ABORTED when the worker was killed from outside,
// DEADLINE_EXCEEDED when its processor time was used up, INTERNAL when it crashed, UNAVAILABLE when
// it could not be started, ended before it was ready, or is of another version. The program is
// opened now, and is the one that is started ever after; NOT_FOUND when there is none.
absl::StatusOr<JobWork> InWorkerProcess(WorkerSettings settings);

}  // namespace rilievo
