// How far each height may go before the surface folds.
#pragma once

#include <vector>

#include "core/geometry/mesh_topology.h"
#include "core/loop/refinement.h"

namespace rilievo {

struct HeightBounds {
  float lowest, highest;  // lowest < 0 < highest
};

// An offset surface folds where 1 + height * curvature reaches 0 (curvature along an edge, positive
// where the domain is convex): a height keeps within nine tenths of the domain's radii of
// curvature on either side, and within `max_height`. `topology`: that of the limit's vertices.
std::vector<HeightBounds> BoundHeights(const MeshTopology& topology, const LimitSurface& limit,
                                       double max_height);

}  // namespace rilievo
