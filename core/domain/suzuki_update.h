// Suzuki's update of the control points (Suzuki et al. 1999; Jeong and Kim 2002, section 4.2, eq.
// 2).
#pragma once

#include <Eigen/Core>

#include "core/domain/domain_samples.h"
#include "core/domain/foot_points.h"

namespace rilievo {

// c_i += lambda w_i (q_i - S_i) for every control vertex i with limit position S_i, foot point
// q_i and robust weight w_i; a boundary vertex also follows the cloud's border. A control vertex
// without data moves with the mean of its neighbours, so that a filled hole travels with its rim.
void SuzukiUpdate(const DomainSamples& samples, const FootPoints& foot_points, double lambda,
                  Eigen::Matrix3Xd* control_points);

}  // namespace rilievo
