// The control points of least energy, by Ceres.
#pragma once

#include <Eigen/Core>

#include "core/base/run_context.h"
#include "core/domain/fit_energy.h"

namespace rilievo {

// Moves `control_points` towards the least of `energy`: inexact Gauss-Newton, for within a round
// the problem is linear. Conjugate gradients (Ceres' nonlinear ones, with searches along lines that
// end at the least of a parabola) in coordinates in which the 3 x 3 blocks of the second
// derivatives are one (block Jacobi), until an iteration's decrease falls below a tenth of the mean
// one (Nash and Sofer 1990). The spline basis is well conditioned: 2 to 16 iterations end within
// 1 % of the RMS of the exact solution. Over a hole, where fairness alone acts, the rough part of
// the start is smoothed and its overall shape kept. Where it is stopped, the points are those it
// came to.
void MinimizeEnergy(const FitEnergy& energy, const RunContext& context,
                    Eigen::Matrix3Xd* control_points);

}  // namespace rilievo
