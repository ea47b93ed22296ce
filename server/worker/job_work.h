// The work behind the service, as a value: in this process, in one of its own, or a test's fake.
#pragma once

#include <functional>
#include <string>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"
#include "core/pipeline/reconstruct.h"
#include "rilievo/v1/report.pb.h"
#include "server/conversion/job_request.h"
#include "server/conversion/scan_bytes.h"

namespace rilievo {

struct JobResult {
  EncodedSurface encoded;  // its chunks; the figures may be left out
  v1::ReconstructReport report;
  int64_t peak_bytes = 0;  // the most resident memory of a worker process; 0: not known
};

// Has the contract of Reconstruct(): called on a thread of the job pool, reports progress on it,
// stops within a second of context.stop. UNAVAILABLE when this machine could not begin to work, so
// that any job would have failed; ABORTED when a worker process was killed from outside, so that
// the same job may well succeed; DEADLINE_EXCEEDED when it used up its processor time; DATA_LOSS
// when the points are not those of their SHA-256.
using JobWork = std::function<absl::StatusOr<JobResult>(const JobRequest& job, ScanBytes points,
                                                        const RunContext& context)>;

// How much memory a worker took, of what a JobWork returned; 0: not known. A status carries it too.
int64_t PeakBytes(const absl::StatusOr<JobResult>& result);
absl::Status WithPeakBytes(absl::Status status, int64_t bytes);

// What the log says of a status: empty for OK.
std::string DetailOf(const absl::Status& status);

// Has the contract of ReconstructAndDrop().
using ReconstructFunction = std::function<absl::StatusOr<Reconstruction>(
    PointCloud scan, const ReconstructOptions& options, const RunContext& context)>;

// Calls `reconstruct` on the thread that asks. What it throws becomes a status.
JobWork InThisProcess(ReconstructFunction reconstruct);
// The same for a server: what its scratch folder does not take is UNAVAILABLE.
JobWork InServerProcess(ReconstructFunction reconstruct);

}  // namespace rilievo
