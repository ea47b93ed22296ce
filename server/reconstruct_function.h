// The work behind the service, as a value: the pipeline in the server, a fake in tests.
#pragma once

#include <functional>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/point_cloud.h"
#include "core/pipeline/reconstruct.h"

namespace rilievo {

// Has the contract of Reconstruct(): called on a thread of the job pool, stops within a second of
// context.stop.
using ReconstructFunction = std::function<absl::StatusOr<Reconstruction>(
    const PointCloud& scan, const ReconstructOptions& options, const RunContext& context)>;

}  // namespace rilievo
