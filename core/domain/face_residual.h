// The Ceres cost of one control face: how far its samples are from their foot points.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/domain/domain_samples.h"
#include "core/domain/sample_targets.h"

namespace ceres {
class CostFunction;
}

namespace rilievo {

// The control points that the samples of a face depend on, ascending; the parameter blocks of its
// residual in this order. 12 for a regular face whose samples are all its own.
std::vector<int> ControlPointsOfFace(const DomainSamples& samples, int face);

// Residuals d_r . (S(u_i) - q_i) for each sample i that the face owns and each of its directions,
// with S(u_i) = sum_j a_ij c_j. Parameter blocks of size 3: the columns of the control points named
// by ControlPointsOfFace(), `points`. `targets` is read at every evaluation and must outlive the
// cost: a new round changes it in place. Null for a face that owns no sample.
std::unique_ptr<ceres::CostFunction> MakeFaceResidual(const DomainSamples& samples, int face,
                                                      const std::vector<int>& points,
                                                      const SampleTargets& targets);

}  // namespace rilievo
