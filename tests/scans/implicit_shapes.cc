// Smooth shapes given by an equation: the genus-2 blend and the star.
#include <array>
#include <cmath>
#include <string>

#include "tests/scans/analytic_shape.h"
#include "tests/scans/closest_point.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// -k log(e^(-a/k) + e^(-b/k)) of the two signed distances: the gradient is a mean of two unit
// vectors, so the field never overestimates the distance.
class Genus2 : public AnalyticShape {
 public:
  std::string name() const override { return "genus2"; }
  int genus() const override { return 2; }
  Eigen::AlignedBox3d bounds() const override {
    // The blend swells the union by at most k log 2, where both tori are equally near.
    const double swell = kBlend * std::log(2.0);
    Eigen::AlignedBox3d box = left_->bounds().merged(right_->bounds());
    box.min().z() -= swell;
    box.max().z() += swell;
    return box;
  }
  double Field(const Vector3d& x) const override {
    const double a = left_->Field(x), b = right_->Field(x);
    return std::min(a, b) - kBlend * std::log1p(std::exp(-std::abs(a - b) / kBlend));
  }
  Vector3d Gradient(const Vector3d& x) const override {
    const double a = left_->Field(x), b = right_->Field(x);
    const double left_weight = 1.0 / (1.0 + std::exp((a - b) / kBlend));
    return left_weight * left_->Gradient(x) + (1.0 - left_weight) * right_->Gradient(x);
  }
  Vector3d ClosestPoint(const Vector3d& x) const override {
    const std::array<Vector3d, 3> starts = {x, left_->ClosestPoint(x), right_->ClosestPoint(x)};
    const bool near = std::abs(Field(x)) < 0.02;
    return ClosestPointOnImplicit(*this, x, std::span(starts).first(near ? 1 : 3));
  }

 private:
  static constexpr double kBlend = 0.06;
  const ShapePtr left_ = MakeTorus({-0.62, 0, 0}, 0.5, 0.2);
  const ShapePtr right_ = MakeTorus({0.62, 0, 0}, 0.5, 0.2);
};

// |x| = r(x / |x|) with r(d) = 1 + 0.4 (dx^4 + dy^4 + dz^4 - 3/5) + 0.06 sin 6dx sin 6dy sin 6dz.
class Star : public AnalyticShape {
 public:
  std::string name() const override { return "star"; }
  int genus() const override { return 0; }
  Eigen::AlignedBox3d bounds() const override {
    // Along an axis the sines vanish and the quartic is largest: r = 1.16.
    const Vector3d half = Vector3d::Constant(1.0 + 0.4 * kQuartic);
    return {-half, half};
  }
  double Field(const Vector3d& x) const override { return x.norm() - Radius(Direction(x)); }
  Vector3d Gradient(const Vector3d& x) const override {
    const Vector3d d = Direction(x);
    const Vector3d g = RadiusGradient(d);
    return d - (g - d * d.dot(g)) / std::max(x.norm(), 1e-9);
  }
  double SafeStep(const Vector3d& x, double field) const override {
    const double radius = x.norm();
    if (radius < 0.75 * kLeastRadius) return kLeastRadius - radius;
    // Within this step the radius stays above half the least one, which bounds the gradient.
    const bool outside = radius > kLeastRadius && field > 0;
    const double floor_radius = outside ? kLeastRadius : 0.5 * kLeastRadius;
    const double lipschitz = std::hypot(1.0, kSteepest / floor_radius);
    const double bound = std::abs(field) / lipschitz;
    return outside ? bound : std::min(bound, 0.25 * kLeastRadius);
  }
  Vector3d ClosestPoint(const Vector3d& x) const override {
    const Vector3d d = Direction(x);
    std::array<Vector3d, 7> starts;
    starts[0] = Radius(d) * d;
    const bool near = std::abs(Field(x)) < 0.02;
    for (int k = 0; k < 6 && !near; ++k) {
      const Vector3d tilted =
          (d + 0.35 * (k % 2 ? 1.0 : -1.0) * Vector3d::Unit(k / 2)).normalized();
      starts[k + 1] = Radius(tilted) * tilted;
    }
    return ClosestPointOnImplicit(*this, x, std::span(starts).first(near ? 1 : 7));
  }

 private:
  static constexpr double kQuartic = 0.4, kBump = 0.06, kPitch = 6.0;
  // r >= 1 + 0.4 (1/3 - 3/5) - 0.06; |grad_S r| <= 0.4 * 1.2 + 0.06 * 6.
  static constexpr double kLeastRadius = 0.83;
  static constexpr double kSteepest = 0.84;

  static Vector3d Direction(const Vector3d& x) {
    const double norm = x.norm();
    return norm > 0 ? Vector3d(x / norm) : Vector3d(Vector3d::UnitX());
  }
  static double Radius(const Vector3d& d) {
    return 1.0 + kQuartic * (d.array().square().square().sum() - 0.6) +
           kBump * (kPitch * d.array()).sin().prod();
  }
  static Vector3d RadiusGradient(const Vector3d& d) {
    const Eigen::Array3d s = (kPitch * d.array()).sin(), c = (kPitch * d.array()).cos();
    const Eigen::Array3d bump(c.x() * s.y() * s.z(), s.x() * c.y() * s.z(), s.x() * s.y() * c.z());
    return (4 * kQuartic * d.array().cube() + kBump * kPitch * bump).matrix();
  }
};

}  // namespace

ShapePtr MakeGenus2() { return std::make_unique<Genus2>(); }
ShapePtr MakeStar() { return std::make_unique<Star>(); }

}  // namespace rilievo
