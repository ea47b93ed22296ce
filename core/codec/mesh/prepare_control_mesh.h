// A control mesh as the .dss codec keeps it: in coding order, control points on the quantiser's
// grid.
#pragma once

#include "absl/status/statusor.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// The same mesh with vertices and faces in the order in which the codec visits them, faces turned
// so that their first corner is the codec's. The order depends on the faces alone, so control
// points may move afterwards. Crease and corner tags and diagonals follow. Idempotent.
// INVALID_ARGUMENT when the mesh is not a manifold.
absl::StatusOr<ControlMesh> CanonicalControlMesh(const ControlMesh& mesh);

// Control points rounded to multiples of StoredStep(`step`) (unit frame, > 0; stored_step.h), the
// sharpness of creases to what crease_coder.h stores. Those on the boundary have `border_digits`
// more binary digits (border_coder.h). Idempotent. INVALID_ARGUMENT when a coordinate is not finite
// or beyond 2^27 steps, and for border digits of a mesh that is not a manifold.
absl::StatusOr<ControlMesh> QuantizeControlMesh(const ControlMesh& mesh, double step,
                                                int border_digits = 0);

// Both. To be called after the fit and before the heights are sampled: then the heights belong to
// the refinement of the coded mesh and take up the rounding of its control points, and EncodeDss
// loses nothing of the control mesh. Idempotent.
absl::StatusOr<ControlMesh> PrepareControlMesh(const ControlMesh& mesh, double position_step,
                                               int border_digits = 0);

}  // namespace rilievo
