// Heights where a closed hole has no points, by the curvature around the hole.
#pragma once

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/displacement/displacement_options.h"
#include "core/displacement/sample_displacement.h"
#include "core/displacement/settings.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"

namespace rilievo {

// Moves the filled heights of each part, connected along edges, until the mean curvature H of the
// displaced surface varies least: sum w_ij (H_i - H_j)^2 over the edges, with cotangent weights w
// and 2 H_i = n_i . sum w_ij (x_j - x_i) / area_i (Pinkall and Polthier 1993; curvature of least
// variation: Moreton and Sequin 1992). So position, slope and curvature go on from the rim, and a
// sphere is kept exactly, whatever the size of the hole. What the heights around a part are off
// would grow inwards: those within a third of its radius move along, held by their squares, and are
// put back at the end. Solved by Gauss-Newton steps, in which w, n and the areas are those of the
// step before. A part stays as it is where two rings around what moves come to a boundary, a crease
// or a corner, where more than kContinueCurvature.most_continued vertices move, which rounding
// would tell, where it is a whole component, and where a height comes to its bound (BoundsOf).
// `rings`, `limit`: of the finest level. Parts that lie apart are solved side by side;
// kContinueCurvature.most_continued vertices take about two seconds of processor time. CANCELLED is
// the only error.
absl::Status ContinueCurvature(const LoopRefinement& refinement, const LevelRings& rings,
                               const LimitSurface& limit, const DisplacementOptions& options,
                               const RunContext& context, DisplacementField* field);

}  // namespace rilievo
