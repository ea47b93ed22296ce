// The border of a Loop surface laid onto lines that are known.
#pragma once

#include <Eigen/Core>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Moves the control points on the border of `*mesh` so that its border, a cubic B-spline between
// corners, comes to `lines` (columns 2 i and 2 i + 1 are the ends of segment i): least squares of
// the distances across the nearest segment, at samples of the curve, in rounds of Gauss and Newton.
// Corners go to the nearest end of a segment. The curve follows what its control points are dense
// enough for; where the lines lie in a plane it ends up in that plane to rounding. `mesh`, `lines`:
// unit frame; the border lies near the lines. INVALID_ARGUMENT for a mesh that is not a manifold;
// CANCELLED.
absl::Status FitBorder(const Eigen::Matrix3Xd& lines, const RunContext& context, ControlMesh* mesh);

}  // namespace rilievo
