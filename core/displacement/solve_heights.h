// All heights by one robust, penalised least-squares fit to the points.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/displacement_options.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

struct SolvedHeights {
  // Per vertex of the finest level.
  std::vector<float> height;      // along the limit normal, unit frame
  std::vector<uint8_t> measured;  // points lie near it
  std::vector<uint8_t> smoothed;  // the height is that of points around it
  // The mean share of a point in its own height: at most so much of the variance of the noise is
  // in the heights.
  double leverage = 1;
};

// The heights that minimise
//   sum over points a (sum weight[k] height[corner[k]] - offset)^2
//     + sum over vertices c bend^2 + d height^2,
// see PointFoot and PlateLevel; a is the weight of a point (Geman and McClure), c the stiffness
// of a thin plate, d what the domain weighs. Where no points are near, the plate continues value
// and slope of what is around; a membrane lets the slope go, and the domain draws the height back,
// over the ranges of SolveSettings. Known sharp lines count as points on the creases. A
// plate whose c is
//   t^4 (spacing / edge)^2 32 sqrt(3) / pi
// on even points and triangles passes waves of wave number k as 1 / (1 + (k t spacing)^4). Each
// region of the surface has the filter length t of least generalised cross-validation (Craven and
// Wahba, "Smoothing noisy data with spline functions", Numer. Math. 31, 1979), so that no estimate
// of the noise enters but for a. Solved coarse to fine (cascadic multigrid, Bornemann and
// Deuflhard 1996). `rings`, `limit`: of the finest level. CANCELLED is the only error.
absl::StatusOr<SolvedHeights> SolveHeights(const OrientedCloud& cloud,
                                           const LoopRefinement& refinement,
                                           const LevelRings& rings, const LimitSurface& limit,
                                           const DisplacementOptions& options,
                                           const RunContext& context);

}  // namespace rilievo
