#include "core/domain/minimize_energy.h"

#include <ceres/first_order_function.h>
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <ceres/iteration_callback.h>

#include <Eigen/Cholesky>
#include <optional>
#include <utility>

#include "core/domain/settings.h"

namespace rilievo {
namespace {

using Points = Eigen::Map<const Eigen::Matrix3Xd>;

// The energy E in units of that at the start, E_0, by y_v = U_v (c_v - start_v) / sqrt(E_0), with
// U_v^T U_v the second derivatives of E by control point v. E is quadratic, so that what a line
// search asks for after its first trial follows from what is known.
class ScaledEnergy final : public ceres::FirstOrderFunction {
 public:
  // `start_gradient`: by the control points.
  ScaledEnergy(const FitEnergy& energy, const Eigen::Matrix3Xd& start, double start_energy,
               const Eigen::Matrix3Xd& start_gradient, const Eigen::Matrix3Xd& blocks,
               const RunContext& context)
      : energy_(energy),
        context_(context),
        start_(start),
        start_energy_(start_energy),
        from_scaled_(3, blocks.cols()) {
    for (Eigen::Index v = 0; v < start.cols(); ++v) {
      Eigen::Matrix3d block = blocks.middleCols<3>(3 * v) / start_energy;
      // On a flat patch nothing but fairness may hold a point along it.
      block.diagonal().array() += kSampleTargets.hold_weight * block.trace();
      const Eigen::LLT<Eigen::Matrix3d> factors(block);
      Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();
      if (factors.info() == Eigen::Success) factors.matrixU().solveInPlace(inverse);
      from_scaled_.middleCols<3>(3 * v) = inverse;
    }
    here_ = {Eigen::VectorXd::Zero(start.size()), 1, Scaled(start_gradient)};
  }

  int NumParameters() const override { return static_cast<int>(start_.size()); }

  Eigen::Matrix3Xd PointsAt(const double* scaled) const {
    const Points y(scaled, 3, start_.cols());
    Eigen::Matrix3Xd points = start_;
    for (Eigen::Index v = 0; v < points.cols(); ++v) {
      points.col(v) += from_scaled_.middleCols<3>(3 * v) * y.col(v);
    }
    return points;
  }

  bool Evaluate(const double* scaled, double* cost, double* gradient) const override {
    const Eigen::Map<const Eigen::VectorXd> y(scaled, start_.size());
    std::optional<Sample> sample = OnTheirLine(y);
    if (!sample) {
      double energy = 0;
      Eigen::Matrix3Xd by_point;
      if (!energy_.Evaluate(PointsAt(scaled), context_, &energy, &by_point).ok()) return false;
      sample = {y, energy / start_energy_, Scaled(by_point)};
      before_ = std::move(here_);
    }
    here_ = *std::move(sample);
    *cost = here_.value;
    if (gradient != nullptr) {
      Eigen::Map<Eigen::VectorXd>(gradient, start_.size()) = here_.gradient;
    }
    return true;
  }

 private:
  struct Sample {
    Eigen::VectorXd at;
    double value = 0;
    Eigen::VectorXd gradient;
  };

  Eigen::VectorXd Scaled(const Eigen::Matrix3Xd& by_point) const {
    Eigen::VectorXd scaled(start_.size());
    for (Eigen::Index v = 0; v < start_.cols(); ++v) {
      scaled.segment<3>(3 * v) =
          from_scaled_.middleCols<3>(3 * v).transpose() * by_point.col(v) / start_energy_;
    }
    return scaled;
  }

  // Of a quadratic function two samples tell all others on their line, where a line search goes
  // after its first trial.
  std::optional<Sample> OnTheirLine(const Eigen::VectorXd& y) const {
    if (y == here_.at) return here_;
    if (before_.at.size() == 0) return std::nullopt;
    const Eigen::VectorXd way = here_.at - before_.at;
    const double length = way.squaredNorm();
    if (!(length > 0)) return std::nullopt;
    const double part = way.dot(y - before_.at) / length;
    if ((y - before_.at - part * way).squaredNorm() >
        kMinimizeEnergy.off_line * kMinimizeEnergy.off_line * length) {
      return std::nullopt;
    }
    Sample sample = {y, 0, before_.gradient + part * (here_.gradient - before_.gradient)};
    sample.value = before_.value + part * way.dot(before_.gradient + sample.gradient) / 2;
    return sample;
  }

  const FitEnergy& energy_;
  const RunContext& context_;
  const Eigen::Matrix3Xd start_;
  const double start_energy_;
  Eigen::Matrix3Xd from_scaled_;
  mutable Sample before_, here_;  // two on the line searched last
};

class SlowedDown final : public ceres::IterationCallback {
 public:
  explicit SlowedDown(const RunContext& context) : context_(context) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (!context_.CheckStop().ok()) return ceres::SOLVER_ABORT;
    if (summary.iteration == 0) {
      start_ = summary.cost;
      return ceres::SOLVER_CONTINUE;
    }
    const double mean = (start_ - summary.cost) / summary.iteration;
    return summary.cost_change < kMinimizeEnergy.forcing * mean
               ? ceres::SOLVER_TERMINATE_SUCCESSFULLY
               : ceres::SOLVER_CONTINUE;
  }

 private:
  const RunContext& context_;
  double start_ = 0;
};

}  // namespace

void MinimizeEnergy(const FitEnergy& energy, const RunContext& context,
                    Eigen::Matrix3Xd* control_points) {
  double start_energy = 0;
  Eigen::Matrix3Xd start_gradient, blocks;
  if (!energy.Evaluate(*control_points, context, &start_energy, &start_gradient).ok()) return;
  if (!(start_energy > 0) || !energy.DiagonalBlocks(context, &blocks).ok()) return;
  auto* const function =
      new ScaledEnergy(energy, *control_points, start_energy, start_gradient, blocks, context);
  const ceres::GradientProblem problem(function);  // takes ownership
  SlowedDown slowed_down(context);
  ceres::GradientProblemSolver::Options options;
  options.line_search_direction_type = ceres::NONLINEAR_CONJUGATE_GRADIENT;
  options.line_search_sufficient_curvature_decrease = kMinimizeEnergy.line_end;
  options.max_num_iterations = kMinimizeEnergy.max_conjugate_gradients;
  options.function_tolerance = 0;
  options.gradient_tolerance = kMinimizeEnergy.least_gradient;
  options.parameter_tolerance = 0;
  options.update_state_every_iteration = true;
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(&slowed_down);
  Eigen::VectorXd scaled = Eigen::VectorXd::Zero(function->NumParameters());
  ceres::GradientProblemSolver::Summary summary;
  ceres::Solve(options, problem, scaled.data(), &summary);
  *control_points = function->PointsAt(scaled.data());
}

}  // namespace rilievo
