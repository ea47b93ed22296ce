// Least-squares height fields z(x, y) over a plane: a plane of 3 terms (1, x, y) or a quadric of 6
// (1, x, y, x^2, xy, y^2).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "core/points/settings.h"

namespace rilievo {

inline constexpr int kHeightFieldLanes = 4;
inline constexpr int kQuadricTerms = 6;
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

// The terms of the field. `ridge`: > 0, added to the diagonal, see kHeightField.ridge.
template <int kTerms>
Eigen::Matrix<double, kTerms, 1> FitHeights(const HeightFieldSums& sums, double ridge) {
  static_assert(kTerms == 3 || kTerms == kQuadricTerms);
  // Monomial m of degree d is x^(d - y) y^y with y = m - d (d + 1) / 2.
  const auto degree_of = [](int m) { return m == 0 ? 0 : m < 3 ? 1 : 2; };
  const auto power_of_y_of = [&](int m) { return m - degree_of(m) * (degree_of(m) + 1) / 2; };
  Eigen::Matrix<double, kTerms, kTerms> root;  // of Cholesky, its diagonal inverted
  Eigen::Matrix<double, kTerms, 1> terms;
  for (int j = 0; j < kTerms; ++j) {
    for (int i = j; i < kTerms; ++i) {
      const int power_of_y = power_of_y_of(i) + power_of_y_of(j);
      const int degree = degree_of(i) + degree_of(j);
      double sum = sums.monomials[degree * (degree + 1) / 2 + power_of_y];
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
