// Heights, normals and spacings of a scan that does not fit into memory, a part of the control
// faces at a time.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/paging/paged_scan.h"
#include "core/paging/scratch_heights.h"
#include "core/paging/scratch_surfels.h"
#include "core/pipeline/reconstruct.h"
#include "core/pipeline/stage_scope.h"
#include "core/scan/scan_surface.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

struct MeasuredPages {
  ScratchHeights heights;
  ScratchSurfels surfels;  // of all points
  int64_t points_of_surface = 0;
};

// Heights at `level` over the control mesh of `surface`, from all points of the scan. `coarse`: the
// thinned scan (PagedScan::Thinned) that control mesh, domain and the heights in `surface` come of;
// `cutter`: of the mesh. The control faces fall into parts whose points, with their halo, lie in
// pages of at most `part_points` points, as far as halving them helps; a part's heights come of the
// points and faces within a halo around it, which take their sides from the coarse points. A vertex
// between parts has the height that was found with its first face. What is known of a point comes
// of the part that sees most of what is around it. Points that no part reads belong to the surface
// where coarse ones of it are near. So all depends on the points and on `part_points`, never on the
// memory there is.
absl::StatusOr<MeasuredPages> MeasureHeightsFromPages(
    const PagedScan& scan, const ScanSurface& coarse, const DisplacedSurface& surface,
    const PartCutter& cutter, int level, int64_t part_points, const ReconstructOptions& options,
    const PipelineContext& context);

}  // namespace rilievo
