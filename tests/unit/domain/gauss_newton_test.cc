#include "core/domain/gauss_newton.h"

#include <ceres/cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <gtest/gtest.h>

#include <memory>

#include "core/domain/fairness.h"
#include "tests/unit/domain/analytic_scenes.h"

namespace rilievo {
namespace {

SampleTargets RandomTargets(const DomainSamples& samples) {
  Random random(7);
  SampleTargets targets;
  targets.positions.resize(3, samples.size());
  targets.weighted_directions.resize(9, samples.size());
  for (int i = 0; i < samples.size(); ++i) {
    for (int k = 0; k < 3; ++k) targets.positions(k, i) = random.Uniform(-1, 1);
    for (int k = 0; k < 9; ++k) targets.weighted_directions(k, i) = random.Uniform(-1, 1);
    targets.row_count.push_back(1 + static_cast<int>(random.Below(3)));
  }
  return targets;
}

// One residual: direction . (sum_k weights[k] c_k - target), c_k parameter blocks of size 3.
class Row final : public ceres::CostFunction {
 public:
  Row(const Eigen::Vector3d& direction, std::vector<double> weights, double target)
      : direction_(direction), weights_(std::move(weights)), target_(target) {
    set_num_residuals(1);
    mutable_parameter_block_sizes()->assign(weights_.size(), 3);
  }
  bool Evaluate(double const* const* points, double* residuals, double** jacobians) const override {
    residuals[0] = -target_;
    for (size_t k = 0; k < weights_.size(); ++k) {
      residuals[0] += weights_[k] * direction_.dot(Eigen::Map<const Eigen::Vector3d>(points[k]));
      if (jacobians == nullptr || jacobians[k] == nullptr) continue;
      Eigen::Vector3d::Map(jacobians[k]) = weights_[k] * direction_;
    }
    return true;
  }

 private:
  const Eigen::Vector3d direction_;
  const std::vector<double> weights_;
  const double target_;
};

// The energy of GaussNewton as a Ceres problem over `points`.
std::unique_ptr<ceres::Problem> ProblemOf(const DomainSamples& samples,
                                          const SampleTargets& targets, const AreaShares& areas,
                                          double fairness, Eigen::Matrix3Xd* points) {
  auto problem = std::make_unique<ceres::Problem>();
  const auto add = [&](const Eigen::Vector3d& direction, const std::vector<int>& vertices,
                       const std::vector<double>& weights, double target) {
    std::vector<double*> blocks;
    for (const int v : vertices) blocks.push_back(points->col(v).data());
    problem->AddResidualBlock(new Row(direction, weights, target), nullptr, blocks);
  };
  const LimitStencils& stencils = samples.stencils;
  for (int i = 0; i < samples.size(); ++i) {
    const auto begin = stencils.begin[i], end = stencils.begin[i + 1];
    for (int r = 0; r < targets.row_count[i]; ++r) {
      const Eigen::Vector3d direction = targets.weighted_directions.block<3, 1>(3 * r, i);
      add(direction,
          {stencils.control_vertices.begin() + begin, stencils.control_vertices.begin() + end},
          {stencils.position.begin() + begin, stencils.position.begin() + end},
          direction.dot(targets.positions.col(i)));
    }
  }
  for (int v = 0; v < samples.control_vertex_count(); ++v) {
    const std::vector<int> vertices = UmbrellaOf(samples, v).vertices;
    if (vertices.size() == 1) continue;
    std::vector<double> weights(vertices.size(), 1.0 / static_cast<double>(vertices.size() - 1));
    weights[0] = -1;
    for (int axis = 0; axis < 3; ++axis) {
      add(std::sqrt(fairness * areas.control_vertices[v]) * Eigen::Vector3d::Unit(axis), vertices,
          weights, 0);
    }
  }
  return problem;
}

double Energy(ceres::Problem& problem) {
  double half = 0;
  EXPECT_TRUE(
      problem.Evaluate(ceres::Problem::EvaluateOptions(), &half, nullptr, nullptr, nullptr));
  return 2 * half;
}

class GaussNewtonOf : public testing::TestWithParam<bool> {
 protected:
  GaussNewtonOf() {
    EXPECT_TRUE(SampleSurface(samples_, mesh_.vertices, RunContext(), &surface_).ok());
    areas_ = ShareArea(samples_, surface_);
  }

  // Valence 4 and 6, closed or with a boundary.
  const ControlMesh mesh_ = OctahedralSphere(0.3, 2, GetParam());
  const DomainSamples samples_ = *BuildDomainSamples(mesh_, 2, RunContext());
  const SampleTargets targets_ = RandomTargets(samples_);
  SampledSurface surface_;
  AreaShares areas_;
};

TEST_P(GaussNewtonOf, StepsToTheMinimumThatCeresFinds) {
  constexpr double kFairness = 3.0;
  Eigen::Matrix3Xd exact = mesh_.vertices;
  const auto exact_problem = ProblemOf(samples_, targets_, areas_, kFairness, &exact);
  const double start = Energy(*exact_problem);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.initial_trust_region_radius = 1e16;
  options.max_trust_region_radius = 1e16;
  options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-16;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, exact_problem.get(), &summary);
  const double least = Energy(*exact_problem);
  ASSERT_LT(least, 0.99 * start);

  Eigen::Matrix3Xd points = mesh_.vertices;
  const auto problem = ProblemOf(samples_, targets_, areas_, kFairness, &points);
  const GaussNewton gauss_newton(samples_, areas_);
  ASSERT_TRUE(gauss_newton.Step(targets_, kFairness, RunContext(), &points).ok());
  EXPECT_LT(Energy(*problem) - least, 0.05 * (start - least));
  for (int step = 0; step < 60; ++step) {
    ASSERT_TRUE(gauss_newton.Step(targets_, kFairness, RunContext(), &points).ok());
  }
  EXPECT_LT((points - exact).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_P(GaussNewtonOf, SaysTheSameWithAnyNumberOfThreads) {
  const GaussNewton gauss_newton(samples_, areas_);
  Eigen::Matrix3Xd one_thread;
  for (const int threads : {1, 2, 4}) {
    RunContext context;
    context.threads = threads;
    Eigen::Matrix3Xd points = mesh_.vertices;
    ASSERT_TRUE(gauss_newton.Step(targets_, 0.5, context, &points).ok());
    if (threads == 1) one_thread = points;
    EXPECT_EQ(points, one_thread);
  }
}

TEST_P(GaussNewtonOf, LeavesControlPointsWithoutTermsWhereTheyAre) {
  SampleTargets none = targets_;
  none.weighted_directions.setZero();
  const GaussNewton gauss_newton(samples_, areas_);
  Eigen::Matrix3Xd points = mesh_.vertices;
  ASSERT_TRUE(gauss_newton.Step(none, 0, RunContext(), &points).ok());
  EXPECT_EQ(points, mesh_.vertices);
}

TEST_P(GaussNewtonOf, CanBeStopped) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  const GaussNewton gauss_newton(samples_, areas_);
  Eigen::Matrix3Xd points = mesh_.vertices;
  EXPECT_EQ(gauss_newton.Step(targets_, 1, context, &points).code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(points, mesh_.vertices);
}

INSTANTIATE_TEST_SUITE_P(ClosedAndOpen, GaussNewtonOf, testing::Values(false, true));

}  // namespace
}  // namespace rilievo
