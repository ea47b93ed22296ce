// Heights along the limit normals of the domain, as in A. Lee, H. Moreton and H. Hoppe, "Displaced
// subdivision surfaces", SIGGRAPH 2000, fitted to unorganized points (solve_heights.h); filled in
// where there are none, and kept from folding the surface.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/displacement_options.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/points/oriented_cloud.h"
#include "core/surface/height_source.h"

namespace rilievo {

struct DisplacementField {
  std::vector<float> heights;        // per vertex of the finest level, unit frame
  std::vector<HeightSource> source;  // same
  int64_t measured = 0, smoothed = 0, filled = 0;
  double leverage = 1;  // as in SolvedHeights
};

// `measured`, `smoothed` and `filled`, from `source`.
void CountSources(DisplacementField* field);

// `rings`, `limit`: of the finest level of `refinement`, of which, unless it is the only one,
// neither faces nor edges are asked for.
absl::StatusOr<DisplacementField> SampleDisplacement(
    const OrientedCloud& cloud, const LoopRefinement& refinement, const LevelRings& rings,
    const LimitSurface& limit, const DisplacementOptions& options, const RunContext& context);

}  // namespace rilievo
