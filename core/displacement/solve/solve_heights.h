// prototype
#pragma once
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/displacement_options.h"
#include "core/displacement/rays/height_samples.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {
absl::StatusOr<HeightSamples> SolveHeights(const OrientedCloud& cloud,
                                           const LoopRefinement& refinement,
                                           const LevelRings& rings, const LimitSurface& limit,
                                           const DisplacementOptions& options,
                                           const RunContext& context);
}  // namespace rilievo
