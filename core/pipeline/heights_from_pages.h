// Heights of a scan that does not fit into memory, a part of the control faces at a time.
#pragma once

#include "absl/status/statusor.h"
#include "core/displacement/sample_displacement.h"
#include "core/paging/scratch_heights.h"
#include "core/pipeline/analyze_pages.h"
#include "core/pipeline/face_parts.h"
#include "core/pipeline/run_parts.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// Heights at `level` over the control mesh of `cutter`, from all points of the scan. A part's
// heights come of the points and faces within its box. A vertex between parts has the height that
// was found with its first face.
absl::StatusOr<ScratchHeights> MeasureHeightsFromPages(
    const KnownPoints& points, const FaceParts& parts, const PartCutter& cutter, int level,
    const DisplacementOptions& options, const PartsRun& run, const RunContext& context);

}  // namespace rilievo
