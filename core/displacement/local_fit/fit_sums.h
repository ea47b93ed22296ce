// Sums over the points of a window, for the fit of a plane or a quadric height(u, v).
#pragma once

#include <array>

namespace rilievo {

// The first `count` points of arrays that go on, with numbers that a weight of 0 makes harmless,
// to the next multiple of kWideLanes.
struct FitPoints {
  const float *u, *v, *height, *weight;
  int count;
  float scale;  // of u and v
};

// Weighted by weight * max(0, 1 - u^2 - v^2), u and v scaled. Monomials u^i v^j stand by degree,
// and in a degree by j: 1, u, v, u^2, uv, v^2, ...
struct FitSums {
  std::array<float, 16> monomials;  // up to degree 4, for a plane 2
  std::array<float, 8> heights;     // monomials up to degree 2, for a plane 1, times the height
};

// The number of the product of two monomials up to degree 2.
constexpr int MonomialOfProduct(int a, int b) {
  constexpr int kDegree[] = {0, 1, 1, 2, 2, 2}, kPowerOfV[] = {0, 0, 1, 0, 1, 2};
  const int degree = kDegree[a] + kDegree[b];
  return degree * (degree + 1) / 2 + kPowerOfV[a] + kPowerOfV[b];
}

// The same bits on every x86-64 machine.
FitSums SumForPlane(const FitPoints& points);
FitSums SumForQuadric(const FitPoints& points);

}  // namespace rilievo
