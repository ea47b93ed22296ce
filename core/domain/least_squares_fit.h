// The robust least-squares fit of the control points, solved by Ceres.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"
#include "core/domain/fit_loop_domain.h"
#include "core/domain/fit_rounds.h"
#include "core/domain/foot_points.h"

namespace rilievo {

// Minimises, over the control points c,
//   sum_i A_i w_i (n_i . (S(u_i) - q_i))^2 + tangential part + fairness(c),
// A_i the area shares, q_i, n_i and w_i the foot points, normals and robust weights found anew each
// round: Gauss-Newton on the squared distance of the surface to the cloud, with iteratively
// reweighted Huber loss, one MinimizeEnergy() a round. A round that takes the surface away from the
// cloud is taken back, and later ones are held ten times firmer beside their foot points. `state`
// as StartRounds() or the last TakeRound() left it. CANCELLED when asked to stop.
absl::Status FitLeastSquares(const DomainSamples& samples, const FitOptions& options,
                             const RunContext& context, FootPointSearch* search, FitState* state);

}  // namespace rilievo
