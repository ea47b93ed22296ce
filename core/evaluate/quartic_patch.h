// A regular triangle of a Loop surface: a quartic polynomial in (u, v).
#pragma once

#include <Eigen/Core>
#include <array>

#include "core/evaluate/surface_jet.h"

namespace rilievo {

// The control points around a face whose corners have valence 6: corners 0, 1, 2, then three outer
// ones of each corner in turn, counter-clockwise (PatchRing() of loop/patch_table.h).
using RegularRing = std::array<Eigen::Vector3d, 12>;

// The quartic box spline over such a ring (Stam 1998, "Evaluation of Loop Subdivision Surfaces",
// appendix A), as coefficients of powers: fewer bytes and quicker than a sum of twelve basis
// functions.
class alignas(64) QuarticPatch {
 public:
  static QuarticPatch Over(const RegularRing& ring);

  // Sets what `order` asks for.
  template <JetOrder kOrder>
  void Evaluate(double u, double v, SurfaceJet& jet) const;
  void Evaluate(double u, double v, JetOrder order, SurfaceJet& jet) const;

 private:
  static constexpr int kDegree = 4, kPowers = 15;
  // Of u^i v^j, i + j <= 4, in rows of j; x, y, z each.
  std::array<double, 3 * kPowers> coefficients_;
};

template <JetOrder kOrder>
void QuarticPatch::Evaluate(double u, double v, SurfaceJet& jet) const {
  for (int axis = 0; axis < 3; ++axis) {
    // Horner's rule in u along each row, the rows by the highest power of v first, and in v over
    // the rows; value, derivative and half the second derivative at once.
    double value = 0, by_v = 0, by_vv = 0, by_u = 0, by_uv = 0, by_uu = 0;
    int row = kPowers;  // the end of the row
#pragma GCC unroll 5
    for (int j = kDegree; j >= 0; --j) {
      row -= kDegree + 1 - j;
      const double* const coefficients = &coefficients_[3 * row + axis];
      double q = coefficients[3 * (kDegree - j)], q1 = 0, q2 = 0;
#pragma GCC unroll 4
      for (int i = kDegree - j - 1; i >= 0; --i) {
        if constexpr (kOrder >= JetOrder::kSecond) q2 = q2 * u + q1;
        if constexpr (kOrder >= JetOrder::kFirst) q1 = q1 * u + q;
        q = q * u + coefficients[3 * i];
      }
      if constexpr (kOrder >= JetOrder::kSecond) {
        by_vv = by_vv * v + by_v;
        by_uv = by_uv * v + by_u;
        by_uu = by_uu * v + q2;
      }
      if constexpr (kOrder >= JetOrder::kFirst) {
        by_v = by_v * v + value;
        by_u = by_u * v + q1;
      }
      value = value * v + q;
    }
    jet.position[axis] = value;
    if constexpr (kOrder >= JetOrder::kFirst) {
      jet.u[axis] = by_u;
      jet.v[axis] = by_v;
    }
    if constexpr (kOrder >= JetOrder::kSecond) {
      jet.uu[axis] = 2 * by_uu;
      jet.uv[axis] = by_uv;
      jet.vv[axis] = 2 * by_vv;
    }
  }
}

}  // namespace rilievo
