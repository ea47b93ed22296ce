// The step of one round of the fit: linear least squares in the control points.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"
#include "core/domain/sample_targets.h"

namespace rilievo {

// The energy, over control points c,
//   E(c) = sum_i sum_r (d_ir . (S_i(c) - q_i))^2 + fairness * sum_v A_v |L c_v|^2,
// with S_i(c) = sum_j a_ij c_j the limit stencil of sample i, q_i and d_ir its target and weighted
// directions (SampleTargets), L c_v the umbrella of control vertex v and A_v its share of the area.
// Each sample and each umbrella is a term: a stencil and a symmetric 3 x 3 matrix. The normal
// equations are never assembled: a product with them is a pass over the terms and one over the
// control points, each control point summing its terms in their order, whatever the threads.
class GaussNewton {
 public:
  // Keeps a reference to the samples.
  GaussNewton(const DomainSamples& samples, const AreaShares& areas);

  // Takes most of the way to the minimum of E: conjugate gradients with 3 x 3 block Jacobi, until
  // the decrease slows (Nash and Sofer 1990). CANCELLED when asked to stop; the control points are
  // as before then.
  absl::Status Step(const SampleTargets& targets, double fairness, const RunContext& context,
                    Eigen::Matrix3Xd* control_points) const;

 private:
  class System;

  // Entries of a term, or of a control point: [begin[i], begin[i + 1]).
  struct Rows {
    std::vector<int> begin = {0};
    std::vector<int> columns;
    std::vector<double> weights;
  };

  const DomainSamples& samples_;
  std::vector<double> umbrella_areas_;  // A_v
  Rows umbrellas_;       // by control vertex: those of its umbrella; none where it is alone
  Rows terms_of_point_;  // by control point: samples, then umbrellas counted on from them
};

}  // namespace rilievo
