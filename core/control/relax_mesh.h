// Rounds a control mesh's faces by sliding its vertices along the surface.
#pragma once

#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// `rounds` of Laplacian smoothing in the tangent plane: each vertex moves to the place of the least
//   sum over its faces of area (n . (x - v))^2 + weight * area |x - g|^2,
// g the mean of its neighbours (boundary vertices: of their two boundary neighbours, and boundary
// edges add planes of their own). On flat parts that is g, on a crease the slide along the crease,
// at a corner next to nothing. No face turns over. Vertices keep their order.
void RelaxTangentially(ControlMesh* mesh, int rounds);

}  // namespace rilievo
