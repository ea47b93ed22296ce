#include "core/domain/face_residual.h"

#include <ceres/cost_function.h>
#include <ceres/gradient_checker.h>
#include <gtest/gtest.h>

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

std::vector<const double*> BlocksOf(const Eigen::Matrix3Xd& control_points,
                                    const std::vector<int>& vertices) {
  std::vector<const double*> blocks;
  for (int vertex : vertices) blocks.push_back(control_points.col(vertex).data());
  return blocks;
}

class FaceResidualOf : public testing::TestWithParam<bool> {
 protected:
  // Valence 4 and 6, closed or with a boundary.
  const ControlMesh mesh_ = OctahedralSphere(0.3, 2, GetParam());
  const DomainSamples samples_ = *BuildDomainSamples(mesh_, 2, RunContext());
  const SampleTargets targets_ = RandomTargets(samples_);
};

TEST_P(FaceResidualOf, HasTheJacobianOfItsResiduals) {
  int checked = 0;
  for (int face = 0; face < samples_.control_face_count(); ++face) {
    const std::vector<int> points = ControlPointsOfFace(samples_, face);
    const auto cost = MakeFaceResidual(samples_, face, points, targets_);
    if (cost == nullptr) continue;
    const auto blocks = BlocksOf(mesh_.vertices, points);
    const std::vector<const ceres::Manifold*> manifolds(blocks.size(), nullptr);
    ceres::GradientChecker checker(cost.get(), &manifolds, ceres::NumericDiffOptions());
    ceres::GradientChecker::ProbeResults results;
    EXPECT_TRUE(checker.Probe(blocks.data(), 1e-8, &results)) << results.error_log;
    ++checked;
  }
  EXPECT_GT(checked, samples_.control_face_count() / 2);
}

// The residuals of all faces are those of all samples, each once.
TEST_P(FaceResidualOf, CountsEachSampleOnce) {
  SampledSurface surface;
  ASSERT_TRUE(SampleSurface(samples_, mesh_.vertices, RunContext(), &surface).ok());
  double expected = 0;
  for (int i = 0; i < samples_.size(); ++i) {
    for (int r = 0; r < targets_.row_count[i]; ++r) {
      const Eigen::Vector3d direction = targets_.weighted_directions.block<3, 1>(3 * r, i);
      const double miss = direction.dot(surface.positions.col(i) - targets_.positions.col(i));
      expected += miss * miss;
    }
  }
  double found = 0;
  for (int face = 0; face < samples_.control_face_count(); ++face) {
    const std::vector<int> points = ControlPointsOfFace(samples_, face);
    const auto cost = MakeFaceResidual(samples_, face, points, targets_);
    if (cost == nullptr) continue;
    const auto blocks = BlocksOf(mesh_.vertices, points);
    Eigen::VectorXd residuals(cost->num_residuals());
    ASSERT_TRUE(cost->Evaluate(blocks.data(), residuals.data(), nullptr));
    found += residuals.squaredNorm();
  }
  EXPECT_NEAR(found, expected, 1e-10 * expected);
}

INSTANTIATE_TEST_SUITE_P(ClosedAndOpen, FaceResidualOf, testing::Values(false, true));

TEST(FaceResidual, RegularFaceHasTwelveControlPoints) {
  const auto samples = BuildDomainSamples(TorusMesh(0.25, 0.1, 12, 8), 2, RunContext());
  ASSERT_TRUE(samples.ok());
  // The first face owns all the samples on it.
  EXPECT_EQ(samples->owned_begin[1], 15);
  EXPECT_EQ(ControlPointsOfFace(*samples, 0).size(), 12u);
  for (int face = 0; face < samples->control_face_count(); ++face) {
    EXPECT_LE(ControlPointsOfFace(*samples, face).size(), 12u);
  }
}

}  // namespace
}  // namespace rilievo
