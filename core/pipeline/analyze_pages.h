// What is known of the points of a scan on disk: found some pages at a time, read box by box.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/paging/paged_scan.h"
#include "core/paging/scratch_surfels.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/run_parts.h"
#include "core/points/oriented_cloud.h"
#include "core/scan/scan_surface.h"

namespace rilievo {

struct AnalyzedPages {
  ScratchSurfels surfels;  // of all points; unit frame of the thinned scan
  int64_t points_of_surface = 0;
};

// `coarse`: the thinned scan, whose sides all points take. Runs of pages are analyzed as scans of
// their own, each with the points in a halo around it, at most `part_points` as far as halving the
// run helps; so what is found depends on the points and on `part_points` alone. Where a scratch
// folder keeps its files, what an earlier run has found there is not looked for again.
absl::StatusOr<AnalyzedPages> AnalyzePages(const PagedScan& scan, const ScanSurface& coarse,
                                           int64_t part_points, const ReconstructOptions& options,
                                           const PartsRun& run, const RunContext& context);

// The points of a scan on disk, with what is known of them.
struct KnownPoints {
  const PagedScan& scan;
  const ScratchSurfels& surfels;
  SpatialFrame frame;  // of the surfels' unit
};

// The points of the surface within the box, in order; unit frame, as the box.
absl::StatusOr<OrientedCloud> CloudIn(const Eigen::AlignedBox3d& box, const KnownPoints& known,
                                      const RunContext& context);

}  // namespace rilievo
