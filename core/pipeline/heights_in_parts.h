// Heights of a large surface in memory, a part of the control faces at a time.
#pragma once

#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/sample_displacement.h"
#include "core/points/oriented_cloud.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

// What SampleDisplacement() finds at `level` over `mesh`, which `cutter` cuts, but that the heights
// of a part come of the points on it and around it alone. Around it are the control faces that
// touch it, more where these are narrower than 16 edges of the finest level, and up to 12 rings of
// faces without points, so that no steps come into holes up to so wide. A vertex between parts has
// the height of the last one. A part has about `part_vertices` vertices of the finest level, those
// around it aside.
absl::StatusOr<DisplacementField> MeasureHeightsInParts(
    const OrientedCloud& cloud, const ControlMesh& mesh, const PartCutter& cutter, int level,
    int64_t part_vertices, const DisplacementOptions& options, const RunContext& context);

}  // namespace rilievo
