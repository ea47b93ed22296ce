// Holes of a control mesh closed by triangles.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Closes each boundary loop that is shorter than `longest_rim` and is the rim of a hole: by the
// triangles of least area over its vertices (Barequet and Sharir 1995), cut to about the length of
// its edges. The outer border of a sheet is the rim of no hole. What tells them apart is the turn
// of the rim within the surface, the sum of pi less the face angles at its vertices: -2 pi around a
// hole in a plane, 0 at the ends of a pipe, 2 pi around a sheet (Gauss and Bonnet). A hole turns by
// at most pi. The new faces come after those of `mesh`, about a quarter as many at most; its
// vertices, creases and corners keep their numbers and places, but flat edges may be flipped.
// `mesh`: an oriented manifold; `longest_rim`: in its unit, > 0. CANCELLED when stopped.
absl::StatusOr<ControlMesh> CloseHoles(ControlMesh mesh, double longest_rim,
                                       const RunContext& context);

}  // namespace rilievo
