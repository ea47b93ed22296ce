// Triangles paired to quads.
#pragma once

#include "core/control/quads/polygon_set.h"

namespace rilievo {

// Neighbours across smooth edges become quads: first those of which one has no other partner left
// (R. Karp and M. Sipser, Maximum matchings in sparse random graphs, FOCS 1981), and those that
// come nearest to rectangles and to four edges a vertex. Of the triangles that are left, each walks
// to the nearest other one, or to the boundary: it takes over corners of the quads on its way.
// Where it crosses a crease or ends at the boundary, that edge gets a vertex in its middle. False
// where a triangle can take no step; then some triangles are left.
bool PairTriangles(PolygonSet* polygons);

}  // namespace rilievo
