// The terrain: an open height field over a square, with the exact distance to the bounded patch.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "tests/scans/analytic_shape.h"

namespace rilievo {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct HeightAt {
  double height;
  Vector2d slope;
  Matrix2d hessian;
};

// Two long waves, a hill of radius 0.2 and a short ripple.
constexpr double kWave = 0.18, kWaveX = 2.1, kWaveY = 1.7, kPhase = 0.3;
constexpr double kHill = 0.1, kHillWidth = 0.08;
constexpr double kRipple = 0.04;
const Vector2d kHillTop(0.3, -0.2), kRippleWave(5.0, 2.0);

double Height(const Vector2d& p) {
  const double wave = kWave * std::sin(kWaveX * p.x() + kPhase) * std::cos(kWaveY * p.y());
  const double hill = kHill * std::exp(-(p - kHillTop).squaredNorm() / kHillWidth);
  return wave + hill + kRipple * std::sin(kRippleWave.dot(p));
}

HeightAt HeightAndSlope(const Vector2d& p) {
  HeightAt at;

  const double sx = std::sin(kWaveX * p.x() + kPhase), cx = std::cos(kWaveX * p.x() + kPhase);
  const double sy = std::sin(kWaveY * p.y()), cy = std::cos(kWaveY * p.y());
  at.height = kWave * sx * cy;
  at.slope = kWave * Vector2d(kWaveX * cx * cy, -kWaveY * sx * sy);
  const double mixed = -kWave * kWaveX * kWaveY * cx * sy;
  at.hessian << -kWave * kWaveX * kWaveX * sx * cy, mixed, mixed,
      -kWave * kWaveY * kWaveY * sx * cy;

  const Vector2d from_top = p - kHillTop;
  const double hill = kHill * std::exp(-from_top.squaredNorm() / kHillWidth);
  at.height += hill;
  at.slope -= hill * 2 / kHillWidth * from_top;
  at.hessian += hill * 2 / kHillWidth *
                (2 / kHillWidth * from_top * from_top.transpose() - Matrix2d::Identity());

  const double phase = kRippleWave.dot(p);
  at.height += kRipple * std::sin(phase);
  at.slope += kRipple * std::cos(phase) * kRippleWave;
  at.hessian -= kRipple * std::sin(phase) * kRippleWave * kRippleWave.transpose();
  return at;
}

class Terrain : public AnalyticShape {
 public:
  std::string name() const override { return "terrain"; }
  bool closed() const override { return false; }
  int genus() const override { return 0; }
  Eigen::AlignedBox3d bounds() const override {
    return {Vector3d(-1, -1, -0.23), Vector3d(1, 1, 0.29)};
  }
  double Field(const Vector3d& x) const override { return x.z() - Height(x.head<2>()); }
  Vector3d Gradient(const Vector3d& x) const override {
    Vector3d gradient;
    gradient << -HeightAndSlope(x.head<2>()).slope, 1.0;
    return gradient;
  }
  double SafeStep(const Vector3d&, double field) const override {
    // The slopes of the three terms are at most 0.378, 0.304 and 0.216.
    constexpr double kSteepest = 0.9;
    return std::abs(field) / std::hypot(1.0, kSteepest);
  }
  bool Contains(const Vector3d& x) const override {
    return std::abs(x.x()) <= 1 && std::abs(x.y()) <= 1;
  }
  Vector3d ClosestPoint(const Vector3d& x) const override;
};

Vector2d ClampToSquare(const Vector2d& p) { return p.cwiseMax(-1.0).cwiseMin(1.0); }

double HalfSquaredDistance(const Vector3d& x, const Vector2d& p) {
  return 0.5 * ((p - x.head<2>()).squaredNorm() + std::pow(Height(p) - x.z(), 2));
}

// Newton on the half squared distance within the square; a coordinate at its bound whose descent
// points outward is held there.
Vector2d Descend(const Vector3d& x, Vector2d p) {
  double cost = HalfSquaredDistance(x, p);
  for (int round = 0; round < 60; ++round) {
    const HeightAt at = HeightAndSlope(p);
    const double above = at.height - x.z();
    Vector2d gradient = p - x.head<2>() + above * at.slope;
    Matrix2d hessian = Matrix2d::Identity() + at.slope * at.slope.transpose() + above * at.hessian;
    for (int axis = 0; axis < 2; ++axis) {
      const bool held =
          (p(axis) >= 1 && gradient(axis) < 0) || (p(axis) <= -1 && gradient(axis) > 0);
      if (!held) continue;
      gradient(axis) = 0;
      hessian(0, 1) = hessian(1, 0) = 0;
      hessian(axis, axis) = 1;
    }
    const bool convex = hessian.determinant() > 0 && hessian.trace() > 0;
    const Vector2d step = convex ? Vector2d(-hessian.inverse() * gradient) : Vector2d(-gradient);
    double scale = 1;
    Vector2d next = ClampToSquare(p + step);
    double next_cost = HalfSquaredDistance(x, next);
    while (next_cost > cost && scale > 1e-12) {
      scale *= 0.5;
      next = ClampToSquare(p + scale * step);
      next_cost = HalfSquaredDistance(x, next);
    }
    const double moved = (next - p).norm();
    if (next_cost <= cost) {
      p = next;
      cost = next_cost;
    }
    if (moved < 1e-14) break;
  }
  return p;
}

Vector3d Terrain::ClosestPoint(const Vector3d& x) const {
  Vector2d best = Descend(x, ClampToSquare(x.head<2>()));
  double best_cost = HalfSquaredDistance(x, best);
  // The nearest point lies within this radius; starts a tenth of a unit apart meet every hill.
  const double reach = std::sqrt(2 * best_cost);
  const int rings = std::min(20, static_cast<int>(reach / 0.1) + (reach > 0.03 ? 1 : 0));
  for (int i = -rings; i <= rings; ++i) {
    for (int j = -rings; j <= rings; ++j) {
      const Vector2d start = x.head<2>() + reach / rings * Vector2d(i, j);
      if (start.cwiseAbs().maxCoeff() > 1) continue;
      const Vector2d candidate = Descend(x, start);
      const double cost = HalfSquaredDistance(x, candidate);
      if (cost < best_cost) {
        best = candidate;
        best_cost = cost;
      }
    }
  }
  return {best.x(), best.y(), Height(best)};
}

}  // namespace

ShapePtr MakeTerrain() { return std::make_unique<Terrain>(); }

}  // namespace rilievo
