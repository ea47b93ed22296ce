// The border of a subdivision surface laid onto lines that are known.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/geometry/triangle_mesh.h"
#include "core/points/known_borders.h"

namespace rilievo {

// After which control points are taken as they are, at rest or not.
inline constexpr int kMostFitRounds = 12;

struct BorderMiss {
  // The edges of the border, as vertices, along which the curve is farther off than is allowed.
  std::vector<std::array<int, 2>> far;
  double most = 0;  // the farthest that the curve is off
};

// Moves the control points on the border of `*mesh` so that its border, a cubic B-spline between
// corners, comes to the lines: least squares of the distances across the nearest segment, at
// samples of the curve, in rounds of Gauss and Newton. Corners go to the nearest corner of the
// lines where one is nearer than their neighbours are, else to the nearest of the lines. Where the
// lines lie in a plane the border ends up in that plane to rounding. Returns where the
// curve is farther off the lines than `allowed`.
// `mesh`: unit frame; its border lies near the lines. INVALID_ARGUMENT for a mesh that is not a
// manifold; CANCELLED.
absl::StatusOr<BorderMiss> FitBorder(const KnownBorders& borders, double allowed,
                                     const RunContext& context, ControlMesh* mesh);

}  // namespace rilievo
