// A given mesh of few triangles as a smooth surface that is bent at its edges alone.
#pragma once

#include <optional>

#include "core/geometry/triangle_mesh.h"
#include "core/surface/measure_error.h"

namespace rilievo {

// `mesh` with each of its edges as a crease: the limit surface is the mesh itself, since a vertex
// where three sharp edges meet is a corner (Hoppe et al. 1994). The vertices of fewer are tagged as
// corners. Unset where `mesh` has as many triangles as `faces` or more, a triangle without area, or
// a vertex of more than 64 triangles. `mesh`: a manifold.
std::optional<ControlMesh> ControlMeshOfFewTriangles(const Shape& mesh, int64_t faces);

}  // namespace rilievo
