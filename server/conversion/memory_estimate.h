// What a job will need, told from its header alone.
#pragma once

#include <cstdint>

#include "server/conversion/job_request.h"

namespace rilievo {

// Bytes at the peak of a worker process: what the hungriest of its stages needs. Fitted to measured
// peaks, two threads, of 20 to 1 000 000 points of six shapes, control meshes of up to 200 000
// faces asked for and of 96 800 given, all levels of samples and of the surface; see the test.
// Scans of thin walls, wires and volumes may need up to a fifth more, and others two thirds of it:
// which it is shows only later.
int64_t EstimateMemory(const JobRequest& job);

// The same of a scan that is made in parts of these sizes: two thirds of a byte for each of its
// `points`, and what a part takes.
int64_t EstimateMemoryOfParts(const PartSizes& sizes, int64_t points);

}  // namespace rilievo
