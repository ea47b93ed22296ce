// The robust least-squares fit of the control points, solved by Ceres.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"
#include "core/domain/fit_loop_domain.h"
#include "core/domain/foot_points.h"

namespace rilievo {

struct LeastSquaresTrace {
  std::vector<double> rms;           // of the cloud: at the start, then after each round taken
  std::vector<double> largest_move;  // of a control point, one a round taken; unit frame
};

// Minimises, over the control points c,
//   sum_i A_i w_i (n_i . (S(u_i) - q_i))^2 + tangential part + fairness(c)
// with foot points q_i found anew each round: a Gauss-Newton iteration on the squared distance of
// the surface to the cloud. Ceres runs one iteration a round on one problem; the foot points are
// looked up in its evaluation callback, so the cost it compares before it takes a step is the true
// distance. Stops early at the first round that does not lower it.
// CANCELLED when asked to stop; `control_points` then holds the last round taken.
absl::Status FitLeastSquares(const DomainSamples& samples, const FitOptions& options,
                             const RunContext& context, FootPointSearch* search,
                             Eigen::Matrix3Xd* control_points, LeastSquaresTrace* trace);

}  // namespace rilievo
