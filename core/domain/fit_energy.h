// What a round of the fit minimises: a quadratic function of the control points.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/domain/domain_samples.h"
#include "core/domain/sample_targets.h"

namespace rilievo {

// E(c) = 1/2 sum_ir (d_ir . (S(u_i) - q_i))^2 + fairness / 2 sum_v A_v |L c_v|^2
// over samples i and their directions r (see SampleTargets), S(u_i) = sum_j a_ij c_j, and over the
// umbrellas L c_v of the control vertices (see UmbrellaOf()). Nothing is assembled: E and its
// gradient are gathered along the stencils, those of a control point in a fixed order, so that they
// do not depend on the number of threads.
class FitEnergy {
 public:
  // `weights`: A_v. `samples` and `targets` are read whenever it is evaluated, and must outlive it:
  // a new round changes the targets in place. CANCELLED when stopped.
  static absl::StatusOr<FitEnergy> Build(const DomainSamples& samples, std::vector<double> weights,
                                         const SampleTargets& targets, const RunContext& context);

  void set_fairness(double fairness) { fairness_ = fairness; }

  // E, and dE / dc where `gradient` is not null; column = control point. CANCELLED when stopped.
  absl::Status Evaluate(const Eigen::Matrix3Xd& control_points, const RunContext& context,
                        double* energy, Eigen::Matrix3Xd* gradient) const;

  // The second derivatives of E by each control point alone: 3 x 3 blocks side by side.
  absl::Status DiagonalBlocks(const RunContext& context, Eigen::Matrix3Xd* blocks) const;

 private:
  // Rows of weights of control points: the stencils, then the umbrellas.
  struct Use {
    int row;
    double weight;
  };

  FitEnergy(const DomainSamples& samples, std::vector<double> weights, const SampleTargets& targets)
      : samples_(samples), targets_(targets), fairness_weights_(std::move(weights)) {}

  void AddUmbrellas();
  void FindUses();
  double Pull(int row, const Eigen::Matrix4Xd& points, Eigen::Vector4d* pull) const;

  const DomainSamples& samples_;
  const SampleTargets& targets_;
  double fairness_ = 0;
  std::vector<int> umbrella_begin_, umbrella_vertices_;
  std::vector<double> umbrella_weights_;
  std::vector<double> fairness_weights_;  // A_v
  // Of control point v: [use_begin_[v], use_begin_[v + 1]), rows ascending.
  std::vector<int> use_begin_;
  std::vector<Use> uses_;
};

}  // namespace rilievo
