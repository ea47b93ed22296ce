// Heights from a scan that does not fit into memory, a part of the control faces at a time.
#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "core/paging/paged_scan.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/sample_heights.h"
#include "core/pipeline/stage_scope.h"
#include "core/scan/scan_surface.h"

namespace rilievo {

// Measures the heights of a surface anew, from all points of the scan. `coarse`: the thinned scan
// (PagedScan::Thinned) that control mesh, domain and the heights in `sampled` come of. The control
// faces fall into parts whose points, with their halo, lie in pages of at most `part_points`
// points, as far as halving them helps; a part's heights come of the points and faces within a
// halo around it, which take their sides from the coarse points, and a vertex between parts has the
// height that the first of them finds. So the heights depend on the points and on `part_points`,
// never on the memory there is. RESOURCE_EXHAUSTED when the level asked for has more than
// max_surface_faces.
absl::Status MeasureHeightsFromPages(const PagedScan& scan, const ScanSurface& coarse,
                                     int64_t part_points, const ReconstructOptions& options,
                                     const PipelineContext& context, SampledSurface* sampled);

}  // namespace rilievo
