// What every round of the fit shares, whichever method moves the control points.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"
#include "core/domain/foot_points.h"

namespace rilievo {

// Control points, and the surface and foot points that belong to them.
struct FitState {
  Eigen::Matrix3Xd control_points;
  SampledSurface surface;
  FootPoints feet;
  std::vector<float> gaps_at_start;  // by control vertex, see GapsToPoints()
  // Of the cloud's distance to the surface, point to plane, unit frame: at the start, then after
  // each round taken.
  std::vector<double> rms;
  double largest_move = 0;  // of a control point in the last round taken
};

// Fills the state for `control_points`.
absl::Status StartRounds(const DomainSamples& samples, const Eigen::Matrix3Xd& control_points,
                         const RunContext& context, FootPointSearch* search, FitState* state);

// One round: `move` changes state->control_points; moves that fold the surface or carry it away
// from the points are taken back, and surface and foot points are found anew. A round after which
// the cloud is farther off than `worst_ratio` times the distance before it (0: no limit), or that
// is not finite, is taken back whole, and `*taken` is false.
absl::Status TakeRound(const DomainSamples& samples, const std::function<void()>& move,
                       double worst_ratio, const RunContext& context, FootPointSearch* search,
                       FitState* state, bool* taken);

}  // namespace rilievo
