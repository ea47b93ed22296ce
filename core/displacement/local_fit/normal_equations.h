// Normal equations of a least-squares fit with a handful of unknowns.
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace rilievo {

// Fill the lower triangle of `matrix` and the right side in `solution`, then Solve. With unit
// noise and weights that are inverse variances, `inverse_first` is the variance of solution[0].
template <int kTerms>
struct NormalEquations {
  Eigen::Matrix<double, kTerms, kTerms> matrix;
  Eigen::Matrix<double, kTerms, 1> solution;
  double inverse_first = 0;  // entry (0, 0) of the inverse matrix

  // Cholesky in place; false when the system is singular to working precision of float sums.
  bool Solve() {
    constexpr double kLeastPivotRatio = 1e-6;
    const double scale = matrix(0, 0);
    for (int j = 0; j < kTerms; ++j) {
      double pivot = matrix(j, j);
      for (int k = 0; k < j; ++k) pivot -= matrix(j, k) * matrix(j, k);
      if (!(pivot > kLeastPivotRatio * scale)) return false;
      matrix(j, j) = std::sqrt(pivot);
      for (int i = j + 1; i < kTerms; ++i) {
        double sum = matrix(i, j);
        for (int k = 0; k < j; ++k) sum -= matrix(i, k) * matrix(j, k);
        matrix(i, j) = sum / matrix(j, j);
      }
    }
    Eigen::Matrix<double, kTerms, 1> first = Eigen::Matrix<double, kTerms, 1>::Zero();
    first[0] = 1;
    for (int i = 0; i < kTerms; ++i) {
      for (int k = 0; k < i; ++k) {
        solution[i] -= matrix(i, k) * solution[k];
        first[i] -= matrix(i, k) * first[k];
      }
      solution[i] /= matrix(i, i);
      first[i] /= matrix(i, i);
    }
    inverse_first = first.squaredNorm();
    for (int i = kTerms - 1; i >= 0; --i) {
      for (int k = i + 1; k < kTerms; ++k) solution[i] -= matrix(k, i) * solution[k];
      solution[i] /= matrix(i, i);
    }
    return true;
  }
};

}  // namespace rilievo
