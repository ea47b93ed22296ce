// What a job will need, told from its header alone.
#pragma once

#include <cstdint>

#include "server/conversion/job_request.h"

namespace rilievo {

// Bytes at the peak of a worker process. Measured on tori of 20 000 to 400 000 points, two threads:
// 60, 157 and 506 MB; estimated 63, 175 and 598.
int64_t EstimateMemory(const JobRequest& job);

}  // namespace rilievo
