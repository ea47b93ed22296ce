// Heights of a large surface in memory, a part of the control faces at a time.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/sample_displacement.h"
#include "core/points/oriented_cloud.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// What SampleDisplacement() finds at `level` over `mesh`, which `cutter` cuts, but for what is far
// from a part: its heights come of its own points and of those of the control faces that touch it.
// A vertex between parts has the height of the last one. `part_vertices`: of the finest level, of a
// part at most.
absl::StatusOr<DisplacementField> MeasureHeightsInParts(
    const OrientedCloud& cloud, const ControlMesh& mesh, const PartCutter& cutter, int level,
    int64_t part_vertices, const DisplacementOptions& options, const RunContext& context);

}  // namespace rilievo
