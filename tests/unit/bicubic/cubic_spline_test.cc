#include "core/bicubic/cubic_spline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace rilievo {
namespace {

constexpr int kSampleIntervals = 32;

Eigen::Matrix3Xd SamplesOf(double (*height)(double)) {
  Eigen::Matrix3Xd samples(3, kSampleIntervals + 1);
  for (int i = 0; i <= kSampleIntervals; ++i) {
    const double t = static_cast<double>(i) / kSampleIntervals;
    samples.col(i) << t, 1 - 2 * t, height(t);
  }
  return samples;
}

Eigen::Matrix3Xd Evaluated(const CubicSpline& spline, const Eigen::Matrix3Xd& control) {
  return control * spline.basis().transpose();
}

TEST(CubicSplineTest, WeightsAreAPartitionOfOne) {
  for (const int spans : {1, 2, 4, 16}) {
    const CubicSpline spline(spans, kSampleIntervals);
    const Eigen::MatrixXd basis = spline.basis();
    EXPECT_GE(basis.minCoeff(), 0.0);
    EXPECT_LT((basis.rowwise().sum().array() - 1).abs().maxCoeff(), 1e-14) << spans;
  }
}

TEST(CubicSplineTest, FitsCubicsExactly) {
  const Eigen::Matrix3Xd samples = SamplesOf([](double t) { return 3 * t * t * t - t * t + 0.5; });
  for (const int spans : {1, 2, 8}) {
    const CubicSpline spline(spans, kSampleIntervals);
    const Eigen::Matrix3Xd fitted = Evaluated(spline, spline.FitCurve(samples));
    EXPECT_LT((fitted - samples).cwiseAbs().maxCoeff(), 1e-13) << spans;
  }
}

// The splines of twice as many spans hold those of fewer.
TEST(CubicSplineTest, HoldsCoarserCurves) {
  const CubicSpline coarse(2, kSampleIntervals), fine(8, kSampleIntervals);
  const Eigen::Matrix3Xd curve =
      Evaluated(coarse, coarse.FitCurve(SamplesOf([](double t) { return std::sin(9 * t); })));
  const Eigen::Matrix3Xd same = Evaluated(fine, fine.FitCurve(curve));
  EXPECT_LT((same - curve).cwiseAbs().maxCoeff(), 1e-13);
}

// The error of cubic splines falls with the fourth power of the spans' length.
TEST(CubicSplineTest, IsOfFourthOrder) {
  const Eigen::Matrix3Xd samples = SamplesOf([](double t) { return std::sin(5 * t); });
  const auto error = [&](int spans) {
    const CubicSpline spline(spans, kSampleIntervals);
    return (Evaluated(spline, spline.FitCurve(samples)) - samples).cwiseAbs().maxCoeff();
  };
  EXPECT_GT(error(2) / error(4), 8);
  EXPECT_GT(error(4) / error(8), 8);
}

}  // namespace
}  // namespace rilievo
