// What the known sharp lines of a shape say of the heights along its creases.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/displacement/feet/point_feet.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// Appends to `feet` one for each vertex of the finest level that lies on a crease or is a corner:
// its own height is that of the place of the sharp lines that is nearest to it. Points beside a
// crease bind it weakly where its two sides nearly face each other, and may be farther apart than
// its vertices. Nothing where `cloud` knows no sharp lines. CANCELLED is the only error.
absl::Status AppendCreaseFeet(const OrientedCloud& cloud, const LoopRefinement& refinement,
                              const LevelRings& rings, const LimitSurface& limit,
                              const RunContext& context, std::vector<PointFoot>* feet);

}  // namespace rilievo
