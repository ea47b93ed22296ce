// The Ceres cost of one control face: how far its samples are from their foot points.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "core/domain/domain_samples.h"

namespace ceres {
class CostFunction;
}

namespace rilievo {

// What the fit asks of every sample in one round. Column = sample.
struct SampleTargets {
  Eigen::Matrix3Xd positions;  // q, unit frame
  // Rows 3 r .. 3 r + 2: direction r times the square root of its weight. Direction 0 is the
  // normal n_q; 1 and 2 are the tangents, of which a sample has all, some or none (row_count).
  Eigen::Matrix<double, 9, Eigen::Dynamic> weighted_directions;
  std::vector<int> row_count;  // 1, 2 or 3; constant over the rounds
};

// The control points that the samples of a face depend on, ascending; the parameter blocks of its
// residual in this order. 12 for a regular face whose samples are all its own.
std::vector<int> ControlPointsOfFace(const DomainSamples& samples, int face);

// Residuals d_r . (S(u_i) - q_i) for each sample i that the face owns and each of its directions,
// with S(u_i) = sum_j a_ij c_j. Parameter blocks of size 3: the columns of the control points named
// by ControlPointsOfFace(). `targets` is read at every evaluation and must outlive the cost: a new
// round changes it in place. Null for a face that owns no sample.
std::unique_ptr<ceres::CostFunction> MakeFaceResidual(const DomainSamples& samples, int face,
                                                      const SampleTargets& targets);

}  // namespace rilievo
