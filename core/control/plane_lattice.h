// A regular triangulation of an area of the plane.
#pragma once

#include "core/control/occupied_area.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Equilateral triangles with sides of about `edge` that fill the area, boundary vertices drawn onto
// its border. Each vertex has one fan of faces (no bow-ties); islands too small for six faces are
// left out. Third coordinate 0; counter-clockwise seen from above. No faces when the area is
// smaller than that.
ControlMesh TriangulateArea(const OccupiedArea& area, double edge);

}  // namespace rilievo
