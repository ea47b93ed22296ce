#include "core/domain/minimize_energy.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <optional>
#include <stop_token>

#include "tests/unit/domain/analytic_scenes.h"
#include "tests/unit/domain/random_targets.h"

namespace rilievo {
namespace {

class MinimizeEnergyTest : public testing::Test {
 protected:
  MinimizeEnergyTest() {
    SampledSurface surface;
    EXPECT_TRUE(SampleSurface(samples_, mesh_.vertices, RunContext(), &surface).ok());
    areas_ = ShareArea(samples_, surface);
    energy_.emplace(*FitEnergy::Build(samples_, areas_.control_vertices, targets_, RunContext()));
    energy_->set_fairness(0.1);
  }

  double At(const Eigen::Matrix3Xd& points) const {
    double value = 0;
    EXPECT_TRUE(energy_->Evaluate(points, RunContext(), &value, nullptr).ok());
    return value;
  }

  Eigen::VectorXd GradientAt(const Eigen::Matrix3Xd& points) const {
    double value = 0;
    Eigen::Matrix3Xd gradient;
    EXPECT_TRUE(energy_->Evaluate(points, RunContext(), &value, &gradient).ok());
    return gradient.reshaped();
  }

  // By a dense factor of the second derivatives, which are differences of the gradient.
  Eigen::Matrix3Xd Least() const {
    const Eigen::VectorXd gradient = GradientAt(mesh_.vertices);
    Eigen::MatrixXd second(gradient.size(), gradient.size());
    for (Eigen::Index k = 0; k < gradient.size(); ++k) {
      Eigen::Matrix3Xd points = mesh_.vertices;
      points.reshaped()[k] += 1;
      second.col(k) = GradientAt(points) - gradient;
    }
    Eigen::Matrix3Xd points = mesh_.vertices;
    points.reshaped() -= second.ldlt().solve(gradient);
    return points;
  }

  const ControlMesh mesh_ = OctahedralSphere(0.3, 2, true);
  const DomainSamples samples_ = *BuildDomainSamples(mesh_, 2, RunContext());
  const SampleTargets targets_ = RandomTargets(samples_);
  AreaShares areas_;
  std::optional<FitEnergy> energy_;
};

TEST_F(MinimizeEnergyTest, EndsNearTheExactSolution) {
  Eigen::Matrix3Xd points = mesh_.vertices;
  MinimizeEnergy(*energy_, RunContext(), &points);
  const double start = At(mesh_.vertices), least = At(Least());
  EXPECT_LT(GradientAt(Least()).norm(), 1e-8);
  EXPECT_LT(At(points) - least, 0.05 * (start - least));
}

TEST_F(MinimizeEnergyTest, StaysAtTheLeast) {
  const Eigen::Matrix3Xd least = Least();
  Eigen::Matrix3Xd points = least;
  MinimizeEnergy(*energy_, RunContext(), &points);
  EXPECT_LT((points - least).norm(), 1e-6);
}

TEST_F(MinimizeEnergyTest, IsTheSameOnAnyNumberOfThreads) {
  Eigen::Matrix3Xd alone = mesh_.vertices, together = mesh_.vertices;
  RunContext context;
  context.threads = 1;
  MinimizeEnergy(*energy_, context, &alone);
  context.threads = 4;
  MinimizeEnergy(*energy_, context, &together);
  EXPECT_EQ(alone, together);
}

TEST_F(MinimizeEnergyTest, LeavesThePointsWhereItIsStopped) {
  std::stop_source source;
  source.request_stop();
  RunContext context;
  context.stop = source.get_token();
  Eigen::Matrix3Xd points = mesh_.vertices;
  MinimizeEnergy(*energy_, context, &points);
  EXPECT_EQ(points, mesh_.vertices);
}

}  // namespace
}  // namespace rilievo
