#include "core/loop/loop_masks.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <numeric>

namespace rilievo {
namespace {

double Sum(const std::vector<double>& weights) {
  return std::accumulate(weights.begin(), weights.end(), 0.0);
}

TEST(LoopBetaTest, KnownValences) {
  EXPECT_NEAR(LoopBeta(3), 3.0 / 16.0, 1e-16);
  EXPECT_NEAR(LoopBeta(6), 1.0 / 16.0, 1e-16);
  EXPECT_NEAR(LoopBeta(4), 31.0 / 256.0, 1e-16);
  EXPECT_NEAR(LoopLimitWeight(6), 1.0 / 12.0, 1e-16);
  EXPECT_NEAR(LoopLimitWeight(3), 1.0 / 5.0, 1e-16);
}

class LimitMaskTest : public ::testing::TestWithParam<int> {};

TEST_P(LimitMaskTest, PositionsSumToOneTangentsToZero) {
  const int n = GetParam();
  for (const LoopLimitMask& mask : {InteriorLimitMask(n), BoundaryLimitMask(n)}) {
    ASSERT_EQ(mask.position.size(), static_cast<size_t>(n));
    ASSERT_EQ(mask.tangent_u.size(), static_cast<size_t>(n));
    ASSERT_EQ(mask.tangent_v.size(), static_cast<size_t>(n));
    EXPECT_NEAR(mask.position_self + Sum(mask.position), 1.0, 1e-14);
    EXPECT_NEAR(mask.tangent_u_self + Sum(mask.tangent_u), 0.0, 1e-13);
    EXPECT_NEAR(mask.tangent_v_self + Sum(mask.tangent_v), 0.0, 1e-13);
  }
}

// The subdivision matrix of a vertex (row 0) and its ring, straight from Loop's rules.
Eigen::MatrixXd RingMatrix(int valence, bool boundary) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(valence + 1, valence + 1);
  const int last = valence;
  if (boundary) {
    matrix(0, 0) = 0.75;
    matrix(0, 1) = matrix(0, last) = 0.125;
  } else {
    const double beta = LoopBeta(valence);
    matrix.row(0).setConstant(beta);
    matrix(0, 0) = 1.0 - valence * beta;
  }
  for (int i = 1; i <= valence; ++i) {
    if (boundary && (i == 1 || i == last)) {
      matrix(i, 0) = matrix(i, i) = 0.5;
      continue;
    }
    matrix(i, 0) = matrix(i, i) = 0.375;
    matrix(i, i == 1 ? last : i - 1) += 0.125;
    matrix(i, i == last ? 1 : i + 1) += 0.125;
  }
  return matrix;
}

Eigen::RowVectorXd Row(double self, const std::vector<double>& ring) {
  Eigen::RowVectorXd row(ring.size() + 1);
  row[0] = self;
  for (size_t i = 0; i < ring.size(); ++i) row[static_cast<Eigen::Index>(i) + 1] = ring[i];
  return row;
}

// A limit mask is a left eigenvector of the subdivision matrix; that is what makes it a limit.
TEST_P(LimitMaskTest, IsALeftEigenvector) {
  const int n = GetParam();
  for (const bool boundary : {false, true}) {
    const LoopLimitMask mask = boundary ? BoundaryLimitMask(n) : InteriorLimitMask(n);
    const Eigen::MatrixXd matrix = RingMatrix(n, boundary);
    double eigenvalue_u = 3.0 / 8.0 + std::cos(2.0 * std::numbers::pi / n) / 4.0;
    double eigenvalue_v = eigenvalue_u;
    if (boundary) {
      eigenvalue_u = 0.5;
      eigenvalue_v = n == 2 ? 0.25 : 3.0 / 8.0 + std::cos(std::numbers::pi / (n - 1)) / 4.0;
    }
    const Eigen::RowVectorXd position = Row(mask.position_self, mask.position);
    const Eigen::RowVectorXd u = Row(mask.tangent_u_self, mask.tangent_u);
    const Eigen::RowVectorXd v = Row(mask.tangent_v_self, mask.tangent_v);
    EXPECT_LT((position * matrix - position).cwiseAbs().maxCoeff(), 1e-14) << boundary;
    EXPECT_LT((u * matrix - eigenvalue_u * u).cwiseAbs().maxCoeff(), 1e-14) << boundary;
    EXPECT_LT((v * matrix - eigenvalue_v * v).cwiseAbs().maxCoeff(), 1e-14) << boundary;
  }
}

TEST_P(LimitMaskTest, TangentsTurnCounterClockwise) {
  const int n = GetParam();
  for (const bool boundary : {false, true}) {
    if (!boundary && n == 2) continue;  // two neighbours span no plane
    const LoopLimitMask mask = boundary ? BoundaryLimitMask(n) : InteriorLimitMask(n);
    const double whole =
        boundary ? (n == 2 ? 0.5 : 1.0) * std::numbers::pi / (n - 1) : 2.0 * std::numbers::pi / n;
    Eigen::Vector2d u = Eigen::Vector2d::Zero(), v = Eigen::Vector2d::Zero();
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector2d neighbor(std::cos(i * whole), std::sin(i * whole));
      u += mask.tangent_u[static_cast<size_t>(i)] * neighbor;
      v += mask.tangent_v[static_cast<size_t>(i)] * neighbor;
    }
    EXPECT_GT(u[0] * v[1] - u[1] * v[0], 0.0) << boundary;
  }
}

INSTANTIATE_TEST_SUITE_P(Valences, LimitMaskTest,
                         ::testing::Values(2, 3, 4, 5, 6, 7, 8, 12, 18, 50));

}  // namespace
}  // namespace rilievo
