// What is known of the points of a block of a scan on disk.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/paging/paged_scan.h"
#include "core/paging/scratch_surfels.h"
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

// `points`: unit frame of `coarse`, whose sides they take. `points_of_scan`: of all of it.
absl::StatusOr<AnalyzedBlock> AnalyzeBlock(const Eigen::Matrix3Xd& points, int64_t points_of_scan,
                                           const ScanSurface& coarse,
                                           const ReconstructOptions& options,
                                           const RunContext& context);

// By point, whether the part has to tell of it: of all parts that read it the one whose box reaches
// farthest around it, for its neighbours are the most complete there; of equals the first.
std::vector<uint8_t> PointsToTellOf(const Eigen::Matrix3Xd& points, size_t part,
                                    const std::vector<Eigen::AlignedBox3d>& boxes);

// Of the points of a part that are its own; their checksum.
absl::StatusOr<uint64_t> WriteSurfels(const AnalyzedBlock& block, size_t part,
                                      const std::vector<uint8_t>& own,
                                      const std::vector<int64_t>& ranks, ScratchSurfels* surfels);

// Points that no part has told of belong to the surface where thinned points of it are near. How
// many of all points do.
absl::StatusOr<int64_t> CompleteSurfels(const PagedScan& scan, const ScanSurface& coarse,
                                        const RunContext& context, ScratchSurfels* surfels);

}  // namespace rilievo
