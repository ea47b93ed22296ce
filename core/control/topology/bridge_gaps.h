// Gaps between the pieces of a control mesh closed by triangles.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Joins pieces whose borders run along each other less than `widest` apart, as the scans of one
// object do that do not quite meet (Karbacher et al.): where vertices of a border follow each other
// that are so near to the border of another piece, the triangles of least area (Fuchs, Kedem and
// Uselton 1977) between it and that border are added, cut to about the length of the edges beside
// them. Pieces that face opposite sides, whose borders run the same way, are not joined, and what
// two bands enclose is a hole, for CloseHoles(). Faces, creases and corners of `mesh` keep their
// numbers, see GrowFaces(). `mesh`: an oriented manifold; `widest`: in its unit, > 0. CANCELLED
// when stopped.
absl::StatusOr<ControlMesh> BridgeGaps(ControlMesh mesh, double widest, const RunContext& context);

}  // namespace rilievo
