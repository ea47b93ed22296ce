// A regular triangulation of an area of the plane.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/planar/occupied_area.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Equilateral triangles with sides of about `edge` that fill the area, boundary vertices drawn onto
// its border. Each fan of faces has a vertex of its own (no bow-ties); islands too small for six
// faces are left out. Time and memory grow with the area and not with the rectangle around it.
// Third coordinate 0; counter-clockwise seen from above. No faces when the area is smaller than
// that.
absl::StatusOr<ControlMesh> TriangulateArea(const OccupiedArea& area, double edge,
                                            const RunContext& context);

}  // namespace rilievo
