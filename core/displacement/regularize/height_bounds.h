// How far each height may go before the surface folds.
#pragma once

#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"

namespace rilievo {

struct HeightBounds {
  float lowest, highest;  // lowest < 0 < highest
};

// An offset surface folds where 1 + height * curvature reaches 0 (curvature along an edge, positive
// where the domain is convex): a height keeps within nine tenths of the domain's radii of
// curvature on either side, and within `max_height`. `rings`: of the limit's vertices.
HeightBounds BoundsOf(int vertex, const LevelRings& rings, const LimitSurface& limit,
                      double max_height);

}  // namespace rilievo
