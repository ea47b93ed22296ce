// Shapes whose signed distance is a closed formula: sphere, torus, cut box, and their union.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "tests/scans/analytic_shape.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Signed distance and its gradient (unit; any of the valid ones on the medial axis).
struct DistanceAt {
  double distance;
  Vector3d gradient;
};

class DistanceShape : public AnalyticShape {
 public:
  virtual DistanceAt At(const Vector3d& x) const = 0;
  double Field(const Vector3d& x) const override { return At(x).distance; }
  Vector3d Gradient(const Vector3d& x) const override { return At(x).gradient; }
  double SafeStep(const Vector3d& x) const override { return std::abs(At(x).distance); }
  Vector3d ClosestPoint(const Vector3d& x) const override {
    const DistanceAt at = At(x);
    return x - at.distance * at.gradient;
  }
};

Vector3d UnitOr(const Vector3d& v, const Vector3d& fallback) {
  const double norm = v.norm();
  return norm > 0 ? Vector3d(v / norm) : fallback;
}

class Sphere : public DistanceShape {
 public:
  Sphere(const Vector3d& center, double radius) : center_(center), radius_(radius) {}
  std::string name() const override { return "sphere"; }
  int genus() const override { return 0; }
  Eigen::AlignedBox3d bounds() const override {
    const Vector3d half = Vector3d::Constant(radius_);
    return {center_ - half, center_ + half};
  }
  DistanceAt At(const Vector3d& x) const override {
    const Vector3d offset = x - center_;
    return {offset.norm() - radius_, UnitOr(offset, Vector3d::UnitX())};
  }

 private:
  Vector3d center_;
  double radius_;
};

class Torus : public DistanceShape {
 public:
  Torus(const Vector3d& center, double ring, double tube)
      : center_(center), ring_(ring), tube_(tube) {}
  std::string name() const override { return "torus"; }
  int genus() const override { return 1; }
  Eigen::AlignedBox3d bounds() const override {
    const Vector3d half(ring_ + tube_, ring_ + tube_, tube_);
    return {center_ - half, center_ + half};
  }
  DistanceAt At(const Vector3d& x) const override {
    const Vector3d offset = x - center_;
    const Vector3d outward = UnitOr(Vector3d(offset.x(), offset.y(), 0), Vector3d::UnitX());
    const Vector3d from_ring = offset - ring_ * outward;
    return {from_ring.norm() - tube_, UnitOr(from_ring, Vector3d::UnitZ())};
  }

 private:
  Vector3d center_;
  double ring_, tube_;
};

// A rectangle with a round hole, extruded. The hole lies inside the rectangle, so the planar
// distance is the larger of the two, exactly.
class CutBox : public DistanceShape {
 public:
  std::string name() const override { return "cutbox"; }
  int genus() const override { return 1; }
  Eigen::AlignedBox3d bounds() const override { return {-kHalf, kHalf}; }

  DistanceAt At(const Vector3d& x) const override {
    const auto [planar, planar_gradient] = Planar(x.head<2>());
    const double axial = std::abs(x.z()) - kHalf.z();
    const double side = x.z() < 0 ? -1.0 : 1.0;
    if (planar > 0 && axial > 0) {
      const double distance = std::hypot(planar, axial);
      Vector3d gradient;
      gradient << planar_gradient * (planar / distance), side * axial / distance;
      return {distance, gradient};
    }
    Vector3d gradient = Vector3d::UnitZ() * side;
    if (planar > axial) gradient << planar_gradient, 0;
    return {std::max(planar, axial), gradient};
  }

 private:
  static constexpr double kHoleRadius = 0.35;
  inline static const Vector3d kHalf{0.8, 0.6, 0.4};

  static std::pair<double, Vector2d> Planar(const Vector2d& p) {
    const double radius = p.norm();
    const double hole = kHoleRadius - radius;
    const Vector2d sign(p.x() < 0 ? -1.0 : 1.0, p.y() < 0 ? -1.0 : 1.0);
    const Vector2d beyond = p.cwiseAbs() - kHalf.head<2>();
    const Vector2d outside = beyond.cwiseMax(0.0);
    const double rectangle = outside.norm() + std::min(beyond.maxCoeff(), 0.0);
    if (hole > rectangle) {
      return {hole, radius > 0 ? Vector2d(-p / radius) : Vector2d(-Vector2d::UnitX())};
    }
    if (outside.maxCoeff() > 0) {
      return {rectangle, Vector2d(outside.normalized().cwiseProduct(sign))};
    }
    const Vector2d axis = beyond.x() > beyond.y() ? Vector2d::UnitX() : Vector2d::UnitY();
    return {rectangle, Vector2d(axis.cwiseProduct(sign))};
  }
};

class Pair : public DistanceShape {
 public:
  std::string name() const override { return "pair"; }
  int components() const override { return 2; }
  int genus() const override { return 1; }
  Eigen::AlignedBox3d bounds() const override { return ball_.bounds().merged(ring_.bounds()); }
  DistanceAt At(const Vector3d& x) const override {
    const DistanceAt ball = ball_.At(x), ring = ring_.At(x);
    return ball.distance < ring.distance ? ball : ring;
  }

 private:
  Sphere ball_{Vector3d(-0.75, 0.1, 0.15), 0.45};
  Torus ring_{Vector3d(0.6, 0, 0), 0.45, 0.18};
};

}  // namespace

ShapePtr MakeSphere(const Vector3d& center, double radius) {
  return std::make_unique<Sphere>(center, radius);
}
ShapePtr MakeTorus(const Vector3d& center, double ring_radius, double tube_radius) {
  return std::make_unique<Torus>(center, ring_radius, tube_radius);
}
ShapePtr MakeCutBox() { return std::make_unique<CutBox>(); }
ShapePtr MakePair() { return std::make_unique<Pair>(); }

}  // namespace rilievo
