#include "core/scan/orientation/kernighan_lin.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rilievo {
namespace {

// Two cliques that should differ, and a third node of the second one that is the last to gain.
TEST(KernighanLinTest, GoesThroughALossToTheBestSigns) {
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(6, 6);
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < a; ++b) {
      weights(a, b) = weights(b, a) = a / 3 == b / 3 ? 3 : -1;
    }
  }
  Eigen::VectorXd signs = Eigen::VectorXd::Ones(6);
  // Each single turn loses: 2 * 3 of its clique against 3 * 1 of the other.
  const double before = signs.dot(weights * signs);
  const double gain = KernighanLinPass(weights, &signs);
  for (int a = 0; a < 6; ++a) EXPECT_EQ(signs[a], signs[a / 3 * 3]);
  EXPECT_EQ(signs[0], -signs[3]);
  EXPECT_NEAR(signs.dot(weights * signs) - before, 4 * gain, 1e-12);
}

TEST(KernighanLinTest, FindsNothingBetterThanTheBest) {
  const Eigen::MatrixXd weights = Eigen::MatrixXd::Ones(4, 4) - Eigen::MatrixXd::Identity(4, 4);
  Eigen::VectorXd signs = Eigen::VectorXd::Ones(4);
  EXPECT_EQ(KernighanLinPass(weights, &signs), 0);
  EXPECT_EQ(signs, Eigen::VectorXd::Ones(4));
}

}  // namespace
}  // namespace rilievo
