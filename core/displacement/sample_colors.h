// Colours of the displaced vertices.
#pragma once

#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/displacement_options.h"
#include "core/geometry/rgb.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// One for each vertex of the finest level of `refinement`: about those for which the colour at the
// foot of a point (FindFeet), linear in its triangle, is the point's own. Found by a few steps of
// the simultaneous iterative reconstruction technique (P. Gilbert, J. Theor. Biol. 36, 1972), each
// a weighted mean of what the points around a vertex miss; points that stay far from their
// neighbours count little (Geman and McClure). Vertices that no point lies beside take means of the
// level below or, where that has none either, of their neighbours. `colors`: of the points of
// `cloud`. `rings`, `limit`: of the finest level; all levels but the finest have their edges. Does
// not depend on the number of threads. CANCELLED is the only error.
absl::StatusOr<std::vector<Rgb>> SampleColors(const OrientedCloud& cloud,
                                              std::span<const Rgb> colors,
                                              const LoopRefinement& refinement,
                                              const LevelRings& rings, const LimitSurface& limit,
                                              const DisplacementOptions& options,
                                              const RunContext& context);

}  // namespace rilievo
