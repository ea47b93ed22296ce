#include "core/evaluate/bicubic_patch.h"

namespace rilievo {
namespace {

// Four control points of a uniform cubic B-spline to the coefficients of 1, t, t^2 and t^3.
template <typename Get, typename Set>
void ToPowers(const Get& get, const Set& set) {
  const Eigen::Vector3d a = get(0), b = get(1), c = get(2), d = get(3);
  set(0, (a + 4 * b + c) / 6);
  set(1, (c - a) / 2);
  set(2, (a - 2 * b + c) / 2);
  set(3, (d - a + 3 * (b - c)) / 6);
}

struct Cubic {
  Eigen::Vector3d value, slope, bend;
};

// Horner's rule for the polynomial, its derivative and half its second derivative.
template <typename Get>
Cubic CubicAt(double t, const Get& get) {
  Cubic cubic{get(3), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (int i = 2; i >= 0; --i) {
    cubic.bend = cubic.bend * t + cubic.slope;
    cubic.slope = cubic.slope * t + cubic.value;
    cubic.value = cubic.value * t + get(i);
  }
  cubic.bend *= 2;
  return cubic;
}

}  // namespace

BicubicPatch BicubicPatch::Over(const QuadGrid& grid) {
  std::array<std::array<Eigen::Vector3d, kPowers>, kPowers> along_s;
  BicubicPatch patch;
  for (size_t j = 0; j < 4; ++j) {
    ToPowers([&](size_t i) { return grid[i][j]; },
             [&](size_t i, const Eigen::Vector3d& power) { along_s[i][j] = power; });
  }
  for (size_t i = 0; i < 4; ++i) {
    ToPowers([&](size_t j) { return along_s[i][j]; },
             [&](size_t j, const Eigen::Vector3d& power) { patch.coefficients_[i][j] = power; });
  }
  return patch;
}

void BicubicPatch::Evaluate(double s, double t, JetOrder order, SurfaceJet& jet) const {
  std::array<Cubic, kPowers> along_t;
  for (size_t i = 0; i < kPowers; ++i) {
    along_t[i] = CubicAt(t, [&](size_t j) { return coefficients_[i][j]; });
  }
  const Cubic point = CubicAt(s, [&](size_t i) { return along_t[i].value; });
  jet.position = point.value;
  if (order == JetOrder::kPosition) return;
  const Cubic across = CubicAt(s, [&](size_t i) { return along_t[i].slope; });
  jet.u = point.slope;
  jet.v = across.value;
  if (order == JetOrder::kFirst) return;
  jet.uu = point.bend;
  jet.uv = across.slope;
  jet.vv = CubicAt(s, [&](size_t i) { return along_t[i].bend; }).value;
}

}  // namespace rilievo
