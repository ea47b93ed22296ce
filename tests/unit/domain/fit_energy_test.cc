#include "core/domain/fit_energy.h"

#include <gtest/gtest.h>

#include <optional>

#include "core/domain/fairness.h"
#include "tests/unit/domain/analytic_scenes.h"
#include "tests/unit/domain/random_targets.h"

namespace rilievo {
namespace {

constexpr double kFairness = 0.3;

// Valence 4 and 6, closed or with a boundary.
class FitEnergyOf : public testing::TestWithParam<bool> {
 protected:
  FitEnergyOf() {
    EXPECT_TRUE(SampleSurface(samples_, mesh_.vertices, RunContext(), &surface_).ok());
    areas_ = ShareArea(samples_, surface_);
    energy_.emplace(*FitEnergy::Build(samples_, areas_.control_vertices, targets_, RunContext()));
    energy_->set_fairness(kFairness);
  }

  double At(const Eigen::Matrix3Xd& points, Eigen::Matrix3Xd* gradient = nullptr,
            int threads = 1) const {
    RunContext context;
    context.threads = threads;
    double value = 0;
    EXPECT_TRUE(energy_->Evaluate(points, context, &value, gradient).ok());
    return value;
  }

  const ControlMesh mesh_ = OctahedralSphere(0.3, 2, GetParam());
  const DomainSamples samples_ = *BuildDomainSamples(mesh_, 2, RunContext());
  const SampleTargets targets_ = RandomTargets(samples_);
  SampledSurface surface_;
  AreaShares areas_;
  std::optional<FitEnergy> energy_;
};

TEST_P(FitEnergyOf, IsHalfTheSquaredMissesAndTheFairness) {
  double expected = 0;
  for (int i = 0; i < samples_.size(); ++i) {
    for (int r = 0; r < targets_.row_count[i]; ++r) {
      const Eigen::Vector3d direction = targets_.weighted_directions.block<3, 1>(3 * r, i);
      const double miss = direction.dot(surface_.positions.col(i) - targets_.positions.col(i));
      expected += miss * miss / 2;
    }
  }
  for (int v = 0; v < samples_.control_vertex_count(); ++v) {
    const Umbrella umbrella = UmbrellaOf(samples_, v);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (size_t k = 1; k < umbrella.vertices.size(); ++k) {
      mean += mesh_.vertices.col(umbrella.vertices[k]) / (umbrella.vertices.size() - 1.0);
    }
    const double bend = (mean - mesh_.vertices.col(v)).squaredNorm();
    expected += kFairness * areas_.control_vertices[v] * bend / 2;
  }
  EXPECT_NEAR(At(mesh_.vertices), expected, 1e-12 * expected);
}

// Central differences of a quadratic function are exact.
TEST_P(FitEnergyOf, HasTheGradientOfItsDifferences) {
  constexpr double kStep = 0.1;
  Eigen::Matrix3Xd gradient;
  At(mesh_.vertices, &gradient);
  for (int v = 0; v < mesh_.vertices.cols(); ++v) {
    for (int k = 0; k < 3; ++k) {
      Eigen::Matrix3Xd points = mesh_.vertices;
      points(k, v) += kStep;
      const double above = At(points);
      points(k, v) -= 2 * kStep;
      EXPECT_NEAR(gradient(k, v), (above - At(points)) / (2 * kStep), 1e-10);
    }
  }
}

TEST_P(FitEnergyOf, HasTheDiagonalBlocksOfItsGradient) {
  Eigen::Matrix3Xd blocks, gradient, moved;
  ASSERT_TRUE(energy_->DiagonalBlocks(RunContext(), &blocks).ok());
  At(mesh_.vertices, &gradient);
  for (int v = 0; v < mesh_.vertices.cols(); ++v) {
    for (int k = 0; k < 3; ++k) {
      Eigen::Matrix3Xd points = mesh_.vertices;
      points(k, v) += 1;
      At(points, &moved);
      EXPECT_LT((moved.col(v) - gradient.col(v) - blocks.col(3 * v + k)).norm(), 1e-10);
    }
  }
}

TEST_P(FitEnergyOf, IsTheSameOnAnyNumberOfThreads) {
  Eigen::Matrix3Xd alone, together;
  EXPECT_EQ(At(mesh_.vertices, &alone, 1), At(mesh_.vertices, &together, 4));
  EXPECT_EQ(alone, together);
}

INSTANTIATE_TEST_SUITE_P(ClosedAndOpen, FitEnergyOf, testing::Values(false, true));

}  // namespace
}  // namespace rilievo
