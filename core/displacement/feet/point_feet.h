// Where the points of a cloud lie above the domain.
#pragma once

#include <array>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/displacement/displacement_options.h"
#include "core/loop/level_rings.h"
#include "core/loop/refinement.h"
#include "core/points/oriented_cloud.h"

namespace rilievo {

// What a point says of the heights: sum weight[k] * height[corner[k]] = offset. It lies in the
// prism that the limit normals span over a triangle of the finest level, where
//   sum w_k (S_k + h N_k) = point
// for barycentric coordinates w and a height h, S and N the limit positions and normals of the
// corners; over a rim, of its triangle, also somewhat below 0. The triangle displaced by h_k there
// passes the point, along its normal n, at
//   sum w_k (N_k . n) (h_k - h).
struct PointFoot {
  std::array<int, 3> corner = {-1, -1, -1};  // vertices of the finest level
  std::array<float, 3> weight = {0, 0, 0};   // w_k (N_k . n)
  float offset = 0;                          // h sum w_k (N_k . n), unit frame
  bool found() const { return corner[0] >= 0; }
};

// One for each point of `cloud`; not found where no prism near it holds the point at a height of at
// most max_height with a normal that agrees. `rings`, `limit`: of the finest level of `refinement`,
// which needs no faces unless it is the only one. CANCELLED is the only error.
absl::StatusOr<std::vector<PointFoot>> FindFeet(const OrientedCloud& cloud,
                                                const LoopRefinement& refinement,
                                                const LevelRings& rings, const LimitSurface& limit,
                                                const DisplacementOptions& options,
                                                const RunContext& context);

// Feet for points that have none, as at tips and webs that the domain passes by: the place of the
// surface displaced by `heights` that is nearest to the point, drawn on the way to it. With the
// way's direction d the row is
//   sum w_k (N_k . d) height[corner[k]] = sum w_k (N_k . d) heights[corner[k]] + length of the way.
// A point gets none where it faces away from the surface, lies sideways of the limit normal, beyond
// a rim, or too far off; otherwise its normal may disagree, for at a tip it does. `spacing`: of the
// points, per vertex of the finest level.
absl::Status ReachPoints(const OrientedCloud& cloud, const LoopRefinement& refinement,
                         const LimitSurface& limit, const std::vector<float>& heights,
                         const std::vector<float>& spacing, const RunContext& context,
                         std::vector<PointFoot>* feet);

}  // namespace rilievo
