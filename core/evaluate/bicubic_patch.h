// A regular quad of a Catmull-Clark surface: a bicubic polynomial in (s, t).
#pragma once

#include <Eigen/Core>
#include <array>

#include "core/evaluate/surface_jet.h"

namespace rilievo {

// The control points around a quad, [i][j] with i along s and j along t; its own corners are those
// of 1 and 2.
using QuadGrid = std::array<std::array<Eigen::Vector3d, 4>, 4>;

// The uniform bicubic B-spline over such a grid, as coefficients of powers.
class BicubicPatch {
 public:
  static BicubicPatch Over(const QuadGrid& grid);

  // `jet.u` and what follows are derivatives in s and t. Sets what `order` asks for.
  void Evaluate(double s, double t, JetOrder order, SurfaceJet& jet) const;

 private:
  static constexpr int kPowers = 4;
  std::array<std::array<Eigen::Vector3d, kPowers>, kPowers> coefficients_;  // of s^i t^j
};

}  // namespace rilievo
