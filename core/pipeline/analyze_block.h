// Some points of a scan, analyzed as a scan of their own.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/pipeline/reconstruct.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/scan_surface.h"

namespace rilievo {

// The analyzed points in the frame and unit that they were given in, lengths too.
OrientedCloud CloudInScanFrame(ScanSurface scan);

// The points of a block as a scan of their own.
struct AnalyzedBlock {
  OrientedCloud cloud;      // unit frame of the whole; no points where they are too few
  std::vector<int> source;  // of each point of it: its column in the block
};

// `points`: unit frame of `coarse`, whose sides they take. `points_of_scan`: of all of it; `curve`:
// the frame of the Morton curve of all of it, in that unit frame.
absl::StatusOr<AnalyzedBlock> AnalyzeBlock(const Eigen::Matrix3Xd& points, int64_t points_of_scan,
                                           const SpatialFrame& curve, const ScanSurface& coarse,
                                           const ReconstructOptions& options,
                                           const RunContext& context);

}  // namespace rilievo
