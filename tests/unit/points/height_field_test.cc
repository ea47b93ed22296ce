#include "core/points/height_field.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>
#include <vector>

namespace rilievo {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;

constexpr double kRidge = 1e-9;

struct Samples {
  std::vector<double> x, y, z, weight;
  HeightFieldPoints points() const {
    return {x.data(), y.data(), z.data(), weight.data(), static_cast<int>(x.size())};
  }
  void Pad() {
    for (std::vector<double>* values : {&x, &y, &z, &weight}) {
      values->resize(HeightFieldRows(static_cast<int>(x.size())), 0.0);
    }
  }
};

Samples Scattered(int count, const Vector6& terms) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> along(-1, 1), weight(0.1, 1);
  Samples samples;
  for (int i = 0; i < count; ++i) {
    const double x = along(random), y = along(random);
    Vector6 row;
    row << 1, x, y, x * x, x * y, y * y;
    samples.x.push_back(x);
    samples.y.push_back(y);
    samples.z.push_back(terms.dot(row) + (i % 2 == 0 ? 0.05 : -0.05));
    samples.weight.push_back(weight(random));
  }
  return samples;
}

template <int kTerms>
Eigen::Matrix<double, kTerms, 1> Reference(const Samples& samples) {
  Eigen::Matrix<double, kTerms, kTerms> gram =
      kRidge * Eigen::Matrix<double, kTerms, kTerms>::Identity();
  Eigen::Matrix<double, kTerms, 1> right = Eigen::Matrix<double, kTerms, 1>::Zero();
  for (size_t i = 0; i < samples.x.size(); ++i) {
    const double x = samples.x[i], y = samples.y[i];
    Vector6 row;
    row << 1, x, y, x * x, x * y, y * y;
    gram += samples.weight[i] * row.head<kTerms>() * row.head<kTerms>().transpose();
    right += samples.weight[i] * samples.z[i] * row.head<kTerms>();
  }
  return gram.ldlt().solve(right);
}

TEST(HeightFieldTest, LeastSquaresOfAnyNumberOfPoints) {
  Vector6 terms;
  terms << 0.1, -0.4, 0.3, 0.8, -0.2, -0.6;
  for (const int count : {7, 17, 18, 64}) {
    const Samples samples = Scattered(count, terms);
    Samples padded = samples;
    padded.Pad();
    HeightFieldPoints points = padded.points();
    points.count = count;
    const HeightFieldSums sums = SumHeights(points);
    EXPECT_LT((FitHeights<6>(sums, kRidge) - Reference<6>(samples)).norm(), 1e-8) << count;
    EXPECT_LT((FitHeights<3>(sums, kRidge) - Reference<3>(samples)).norm(), 1e-8) << count;
    double squares = 0;
    for (int i = 0; i < count; ++i) squares += samples.weight[i] * samples.z[i] * samples.z[i];
    EXPECT_NEAR(sums.squares, squares, 1e-12 * squares);
  }
}

TEST(HeightFieldTest, PointsOnOneLineGiveFiniteTerms) {
  Samples samples;
  for (int i = 0; i < 16; ++i) {
    samples.x.push_back(0.1 * i);
    samples.y.push_back(0);
    samples.z.push_back(0.2 * i);
    samples.weight.push_back(1);
  }
  const Vector6 terms = FitHeights<6>(SumHeights(samples.points()), kRidge);
  EXPECT_TRUE(terms.allFinite());
  EXPECT_NEAR(terms[1], 2, 1e-4);
}

}  // namespace
}  // namespace rilievo
