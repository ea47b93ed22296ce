#include "core/domain/least_squares_fit.h"

#include <ceres/cost_function.h>
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/domain/face_residual.h"
#include "core/domain/fairness.h"
#include "core/domain/sample_targets.h"

namespace rilievo {
namespace {

// The trust region never binds: within a round the problem is linear.
constexpr double kUnboundedRadius = 1e16;
// Inexact Gauss-Newton: conjugate gradients on the normal equations with 3 x 3 block Jacobi, until
// the model's decrease slows to this ratio (Nash and Sofer 1990). The spline basis is well
// conditioned: 2 to 16 iterations end within 1 % of the RMS that SPARSE_NORMAL_CHOLESKY gives, and
// 4 500 unknowns take 2 ms an iteration instead of 140 ms a factor, growing in proportion to the
// control points. Over a hole, where fairness alone acts, the rough part of the start is smoothed
// and its overall shape kept.
constexpr double kForcing = 0.1;
constexpr int kMaxConjugateGradients = 30;
constexpr int64_t kFacesPerTask = 256;
// Of the progress: what came before.
constexpr double kLeastSquaresBegin = 0.2;
// A round after which the cloud is farther off than this many times the distance before it is
// taken back.
constexpr double kWorse = 1.05;
// So many times the RMS wanted are out of reach after the first round: the later ones take off a
// tenth to a sixth together.
constexpr double kOutOfReach = 1.4;

class StopCallback final : public ceres::IterationCallback {
 public:
  explicit StopCallback(const RunContext& context) : context_(context) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    return context_.CheckStop().ok() ? ceres::SOLVER_CONTINUE : ceres::SOLVER_ABORT;
  }

 private:
  const RunContext& context_;
};

absl::Status AddResiduals(const DomainSamples& samples, const SampleTargets& targets,
                          const AreaShares& areas, const double* fairness,
                          const RunContext& context, Eigen::Matrix3Xd* control_points,
                          ceres::Problem* problem) {
  const int faces = samples.control_face_count();
  std::vector<std::vector<int>> points(static_cast<size_t>(faces));
  std::vector<std::unique_ptr<ceres::CostFunction>> costs(points.size());
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(faces, kFacesPerTask, context, [&](int64_t begin, int64_t end) {
        for (int64_t face = begin; face < end; ++face) {
          const int f = static_cast<int>(face);
          points[face] = ControlPointsOfFace(samples, f);
          costs[face] = MakeFaceResidual(samples, f, points[face], targets);
        }
      }));
  std::vector<double*> blocks;
  const auto blocks_of = [&](const std::vector<int>& vertices) {
    blocks.clear();
    for (int vertex : vertices) blocks.push_back(control_points->col(vertex).data());
    return blocks;
  };
  for (size_t face = 0; face < costs.size(); ++face) {
    if (costs[face] == nullptr) continue;
    problem->AddResidualBlock(costs[face].release(), nullptr, blocks_of(points[face]));
  }
  for (int vertex = 0; vertex < samples.control_vertex_count(); ++vertex) {
    const Umbrella umbrella = UmbrellaOf(samples, vertex);
    const int neighbors = static_cast<int>(umbrella.vertices.size()) - 1;
    if (neighbors == 0) continue;
    const double share = areas.control_vertices[static_cast<size_t>(vertex)];
    problem->AddResidualBlock(MakeFairnessResidual(neighbors, share, fairness).release(), nullptr,
                              blocks_of(umbrella.vertices));
  }
  return absl::OkStatus();
}

ceres::Solver::Options SolverOptions(StopCallback* stop) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::CGNR;
  options.preconditioner_type = ceres::JACOBI;
  options.eta = kForcing;
  options.max_linear_solver_iterations = kMaxConjugateGradients;
  options.max_num_iterations = 1;
  // It would depend on the axes and the unit.
  options.jacobi_scaling = false;
  options.initial_trust_region_radius = kUnboundedRadius;
  options.max_trust_region_radius = kUnboundedRadius;
  options.function_tolerance = 0;
  options.gradient_tolerance = 0;
  options.parameter_tolerance = 0;
  // More threads would add up costs in an order that depends on their number.
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(stop);
  return options;
}

}  // namespace

absl::Status FitLeastSquares(const DomainSamples& samples, const FitOptions& options,
                             const RunContext& context, FootPointSearch* search, FitState* state) {
  const AreaShares areas = ShareArea(samples, state->surface);
  SampleTargets targets = MakeSampleTargets(samples);
  double fairness = 0;
  ceres::Problem::Options problem_options;
  problem_options.disable_all_safety_checks = true;
  ceres::Problem problem(problem_options);
  // The problem keeps the addresses of the control points: rounds change them in place.
  RILIEVO_RETURN_IF_ERROR(
      AddResiduals(samples, targets, areas, &fairness, context, &state->control_points, &problem));
  StopCallback stop(context);
  const ceres::Solver::Options solver_options = SolverOptions(&stop);
  double tangential_weight = options.tangential_weight;
  for (int round = 0; round < options.rounds; ++round) {
    context.Report(Stage::kDomainFit,
                   kLeastSquaresBegin + (1 - kLeastSquaresBegin) * round / options.rounds);
    fairness = FairnessOfRound(options.fairness_start, options.fairness_end, round, options.rounds);
    const std::vector<double> stiffness =
        SliverStiffness(samples, state->control_points, state->surface);
    RILIEVO_RETURN_IF_ERROR(AimSamples(samples, state->surface, state->feet, areas, stiffness,
                                       tangential_weight, context, &targets));
    const auto solve = [&] {
      ceres::Solver::Summary summary;
      ceres::Solve(solver_options, &problem, &summary);
    };
    bool taken = false;
    RILIEVO_RETURN_IF_ERROR(TakeRound(samples, solve, kWorse, context, search, state, &taken));
    if (!taken) tangential_weight = std::clamp(10 * tangential_weight, 0.1, 1.0);
    if (options.wanted_rms > 0 && taken && state->rms.back() > kOutOfReach * options.wanted_rms) {
      break;
    }
  }
  return absl::OkStatus();
}

}  // namespace rilievo
