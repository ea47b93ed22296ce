// What a job will need, told from its header alone.
#pragma once

#include <cstdint>

#include "server/conversion/job_request.h"

namespace rilievo {

// Bytes at the peak of a worker process. Measured with clean tori of 20 000, 100 000, 200 000 and
// 1 000 000 points, two threads: 38.5, 85.5, 130 and 459 MB; estimated 42, 90, 150 and 526. Other
// shapes need less, half a million noisy points 172 MB.
int64_t EstimateMemory(const JobRequest& job);

}  // namespace rilievo
