// Least-squares height fields z(x, y) over a plane: a plane of 3 terms (1, x, y) or a quadric of 6
// (1, x, y, x^2, xy, y^2).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

namespace rilievo {

inline constexpr int kHeightFieldLanes = 4;
inline constexpr int HeightFieldRows(int points) {
  return (points + kHeightFieldLanes - 1) / kHeightFieldLanes * kHeightFieldLanes;
}

// Arrays of HeightFieldRows(count) numbers, finite, the weights from `count` on 0.
struct HeightFieldPoints {
  const double *x, *y, *z, *weight;
  int count;
};

// Sums over the points of weight times
struct HeightFieldSums {
  std::array<double, 15> monomials;  // x^i y^j up to degree 4: 1, x, y, x^2, xy, y^2, x^3, ...
  std::array<double, 6> heights;     // z times those up to degree 2
  double squares;                    // z^2
};

// The same bits on every x86-64 machine.
HeightFieldSums SumHeights(const HeightFieldPoints& points);

inline constexpr int kQuadricTerms = 6;
// Least share of the largest weight that is added to the diagonal: points on one line, or nearly,
// leave a field undetermined.
inline constexpr double kRidge = 1e-6;

// The terms of the field. `ridge`: > 0, added to the diagonal, for points on one line leave it
// undetermined.
template <int kTerms>
Eigen::Matrix<double, kTerms, 1> FitHeights(const HeightFieldSums& sums, double ridge) {
  static_assert(kTerms == 3 || kTerms == 6);
  const auto degree_of = [](int term) { return term == 0 ? 0 : term < 3 ? 1 : 2; };
  Eigen::Matrix<double, kTerms, kTerms> root;  // of Cholesky, its diagonal inverted
  Eigen::Matrix<double, kTerms, 1> terms;
  for (int j = 0; j < kTerms; ++j) {
    for (int i = j; i < kTerms; ++i) {
      // The terms of a degree ascend by their power of y, as the monomials do.
      const int a = degree_of(i), b = degree_of(j);
      const int power_of_y = i - a * (a + 1) / 2 + j - b * (b + 1) / 2;
      double sum = sums.monomials[(a + b) * (a + b + 1) / 2 + power_of_y];
      if (i == j) sum += ridge;
      for (int k = 0; k < j; ++k) sum -= root(i, k) * root(j, k);
      // Rounding leaves a pivot of at least about the ridge.
      root(i, j) = i == j ? 1 / std::sqrt(std::max(sum, ridge / 2)) : sum * root(j, j);
    }
    double sum = sums.heights[j];
    for (int k = 0; k < j; ++k) sum -= root(j, k) * terms[k];
    terms[j] = sum * root(j, j);
  }
  for (int j = kTerms - 1; j >= 0; --j) {
    for (int i = j + 1; i < kTerms; ++i) terms[j] -= root(i, j) * terms[i];
    terms[j] *= root(j, j);
  }
  return terms;
}

}  // namespace rilievo
