// What all points of a scan on disk tell before they are thinned.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/paging/paged_scan.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/run_parts.h"
#include "core/scan/scan_surface.h"

namespace rilievo {

// Medians over the points of a scan, fractions of the diagonal.
struct PointMedians {
  double spacing = 0;
  double noise = 0;
};

// By place in the order of all points, whether a point is an outlier or of foliage (FindKept). Runs
// of up to 64 pages are looked at, each by itself, as parts of the step kLeftOut, so an island
// counts as one only in a scan of a single run. Once the points are thinned neither can be told:
// outliers lie no farther from each other than other points do, and leaves no denser in their
// volume than a surface.
absl::StatusOr<std::vector<bool>> LeftOutOfPages(const PagedScan& pages,
                                                 const ReconstructOptions& options,
                                                 const PartsRun& run, const RunContext& context);

// Of all points of a scan of up to 262 144; of a larger one, of 16 runs of 16 384 points, spread
// evenly over the curve. `coarse`: the thinned points, whose sides they take. A thinned scan takes
// much of its curvature for noise.
absl::StatusOr<PointMedians> MediansOfPages(const PagedScan& pages, const ScanSurface& coarse,
                                            const ReconstructOptions& options,
                                            const RunContext& context);

}  // namespace rilievo
