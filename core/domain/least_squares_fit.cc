#include "core/domain/least_squares_fit.h"

#include <ceres/cost_function.h>
#include <ceres/evaluation_callback.h>
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/domain/face_residual.h"
#include "core/domain/fairness.h"

namespace rilievo {
namespace {

constexpr int64_t kSamplesPerTask = 2048;
// Weight of the pull of a boundary sample towards the cloud's border, beside the 1 of its distance.
constexpr double kBorderWeight = 0.3;
// Holds a sample without data where it is, just enough to keep the system regular where fairness
// leaves it free (a component of the control mesh that no point supports).
constexpr double kHoldWeight = 1e-9;
// Gauss-Newton: a trust region that never binds. A step that does not help ends the fit instead.
constexpr double kUnboundedRadius = 1e16;
// Inexact Gauss-Newton: conjugate gradients on the normal equations with 3 x 3 block Jacobi, until
// the model's decrease slows to this ratio (Nash and Sofer 1990). The spline basis is well
// conditioned: 2 to 16 iterations end within 1 % of the RMS that SPARSE_NORMAL_CHOLESKY gives, and
// 4 500 unknowns take 2 ms an iteration instead of 140 ms a factor, growing in proportion to the
// control points. Over a hole, where fairness alone acts, the rough part of the start is smoothed
// and its overall shape kept.
constexpr double kForcing = 0.1;
constexpr int kMaxConjugateGradients = 30;

// The control points as Ceres sees them, and all that is looked up anew at each evaluation.
class Rounds final : public ceres::EvaluationCallback, public ceres::IterationCallback {
 public:
  Rounds(const DomainSamples& samples, const FitOptions& options, const RunContext& context,
         FootPointSearch* search, const Eigen::Matrix3Xd* control_points, LeastSquaresTrace* trace)
      : samples_(samples),
        options_(options),
        context_(context),
        search_(search),
        control_points_(control_points),
        trace_(trace) {}

  absl::Status Start() {
    RILIEVO_RETURN_IF_ERROR(SampleSurface(samples_, *control_points_, context_, &surface_));
    areas_ = ShareArea(samples_, surface_);
    last_points_ = *control_points_;
    fairness_ = FairnessOfRound(options_.fairness_start, options_.fairness_end, 0, options_.rounds);
    CountRows();
    return absl::OkStatus();
  }

  void PrepareForEvaluation(bool evaluate_jacobians, bool new_evaluation_point) override {
    if (!status_.ok()) return;
    if (new_evaluation_point) status_ = FindFootPoints();
    if (!status_.ok() || !evaluate_jacobians) return;
    trace_->rms.push_back(search_->cloud_rms());
    if (trace_->rms.size() > 1) FinishRound();
  }

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (status_.ok()) status_ = context_.CheckStop();
    if (!status_.ok()) return ceres::SOLVER_ABORT;
    context_.Report(Stage::kDomainFit, 0.2 + 0.8 * std::min(1.0, double(round_) / options_.rounds));
    return summary.step_is_successful ? ceres::SOLVER_CONTINUE
                                      : ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }

  const absl::Status& status() const { return status_; }
  const SampleTargets& targets() const { return targets_; }
  const AreaShares& areas() const { return areas_; }
  const SampledSurface& surface() const { return surface_; }
  const double* fairness() const { return &fairness_; }

 private:
  void CountRows() {
    targets_.positions.setZero(3, samples_.size());
    targets_.weighted_directions.setZero(9, samples_.size());
    targets_.row_count.resize(static_cast<size_t>(samples_.size()));
    for (int i = 0; i < samples_.size(); ++i) {
      const bool corner = i < samples_.control_vertex_count();
      targets_.row_count[static_cast<size_t>(i)] = corner ? 3 : samples_.on_boundary(i) ? 2 : 1;
    }
  }

  absl::Status FindFootPoints() {
    RILIEVO_RETURN_IF_ERROR(SampleSurface(samples_, *control_points_, context_, &surface_));
    RILIEVO_RETURN_IF_ERROR(search_->Update(surface_, context_, &feet_));
    return ParallelFor(samples_.size(), kSamplesPerTask, context_, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) AimAt(static_cast<int>(i));
    });
  }

  // The tangential part holds the samples of the control vertices beside their foot points; those
  // of the boundary are drawn to the cloud's border.
  void AimAt(int sample) {
    const auto i = static_cast<size_t>(sample);
    const bool corner = sample < samples_.control_vertex_count();
    const double share = areas_.samples[i];
    const double corner_share = corner ? areas_.control_vertices[i] : 0;
    auto directions = targets_.weighted_directions.col(sample);
    targets_.positions.col(sample) = surface_.positions.col(sample) +
                                     feet_.offset[i] * feet_.normals.col(sample) +
                                     feet_.border_offset[i] * feet_.conormals.col(sample);
    if (feet_.weight[i] == 0 && feet_.border_weight[i] == 0) {
      const double hold = std::sqrt(kHoldWeight * corner_share);
      directions << hold, 0, 0, 0, hold, 0, 0, 0, hold;
      if (!corner) directions.setZero();
      return;
    }
    Eigen::Vector3d normal = feet_.normals.col(sample);
    if (feet_.weight[i] == 0) normal = surface_.normals.col(sample);
    Eigen::Vector3d across = feet_.conormals.col(sample);
    if (across.isZero()) across = normal.unitOrthogonal();
    const double across_weight = feet_.border_weight[i] > 0
                                     ? kBorderWeight * share
                                     : options_.tangential_weight * corner_share;
    directions.segment<3>(0) = std::sqrt(feet_.weight[i] * share) * normal;
    directions.segment<3>(3) = std::sqrt(across_weight) * across;
    directions.segment<3>(6) =
        std::sqrt(options_.tangential_weight * corner_share) * normal.cross(across);
  }

  void FinishRound() {
    ++round_;
    trace_->largest_move.push_back(
        std::sqrt((*control_points_ - last_points_).colwise().squaredNorm().maxCoeff()));
    last_points_ = *control_points_;
    fairness_ = FairnessOfRound(options_.fairness_start, options_.fairness_end,
                                std::min(round_, options_.rounds - 1), options_.rounds);
  }

  const DomainSamples& samples_;
  const FitOptions& options_;
  const RunContext& context_;
  FootPointSearch* const search_;
  const Eigen::Matrix3Xd* const control_points_;
  LeastSquaresTrace* const trace_;

  absl::Status status_;
  SampledSurface surface_;
  AreaShares areas_;
  FootPoints feet_;
  SampleTargets targets_;
  Eigen::Matrix3Xd last_points_;
  double fairness_ = 0;
  int round_ = 0;
};

void AddResiduals(const DomainSamples& samples, const Rounds& rounds,
                  Eigen::Matrix3Xd* control_points, ceres::Problem* problem) {
  std::vector<double*> blocks;
  const auto blocks_of = [&](const std::vector<int>& vertices) {
    blocks.clear();
    for (int vertex : vertices) blocks.push_back(control_points->col(vertex).data());
    return blocks;
  };
  for (int face = 0; face < samples.control_face_count(); ++face) {
    auto cost = MakeFaceResidual(samples, face, rounds.targets());
    if (cost == nullptr) continue;
    problem->AddResidualBlock(cost.release(), nullptr,
                              blocks_of(ControlPointsOfFace(samples, face)));
  }
  for (int vertex = 0; vertex < samples.control_vertex_count(); ++vertex) {
    const Umbrella umbrella = UmbrellaOf(samples, vertex);
    const int neighbors = static_cast<int>(umbrella.vertices.size()) - 1;
    const double share = rounds.areas().control_vertices[static_cast<size_t>(vertex)];
    problem->AddResidualBlock(MakeFairnessResidual(neighbors, share, rounds.fairness()).release(),
                              nullptr, blocks_of(umbrella.vertices));
  }
}

ceres::Solver::Options SolverOptions(int rounds, Rounds* callback) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::CGNR;
  options.preconditioner_type = ceres::JACOBI;
  options.eta = kForcing;
  options.max_linear_solver_iterations = kMaxConjugateGradients;
  options.jacobi_scaling = false;
  options.max_num_iterations = rounds;
  options.initial_trust_region_radius = kUnboundedRadius;
  options.max_trust_region_radius = kUnboundedRadius;
  options.function_tolerance = 0;
  options.gradient_tolerance = 0;
  options.parameter_tolerance = 0;
  // More threads would add up costs in an order that depends on their number.
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(callback);
  return options;
}

}  // namespace

absl::Status FitLeastSquares(const DomainSamples& samples, const FitOptions& options,
                             const RunContext& context, FootPointSearch* search,
                             Eigen::Matrix3Xd* control_points, LeastSquaresTrace* trace) {
  const Eigen::Matrix3Xd start = *control_points;
  Rounds rounds(samples, options, context, search, control_points, trace);
  RILIEVO_RETURN_IF_ERROR(rounds.Start());
  ceres::Problem::Options problem_options;
  problem_options.evaluation_callback = &rounds;
  ceres::Problem problem(problem_options);
  AddResiduals(samples, rounds, control_points, &problem);
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  ceres::Solver::Summary summary;
  ceres::Solve(SolverOptions(options.rounds, &rounds), &problem, &summary);
  RILIEVO_RETURN_IF_ERROR(rounds.status());
  if (!control_points->allFinite()) *control_points = start;
  return absl::OkStatus();
}

}  // namespace rilievo
