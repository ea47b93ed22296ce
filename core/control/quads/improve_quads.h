// Quads whose edges are turned towards four edges a vertex.
#pragma once

#include "core/control/quads/polygon_set.h"

namespace rilievo {

// Turns the edge between two quads within their hexagon, or all edges of a vertex to the opposite
// corners of its quads, where that brings the valences nearer to four (three on the boundary) or
// leaves fewer flat corners (IsFlatCorner), or, with these as good as they were, makes the quads
// squarer. Takes out vertices inside that two quads alone meet in, where the surface is flat there
// and the quad that is left is not folded. All are quads before and after; creases and sharp
// vertices stay.
void ImproveQuads(PolygonSet* polygons);

}  // namespace rilievo
