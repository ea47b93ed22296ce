// Shapes whose signed distance is a closed formula: sphere, torus, their union, extruded profiles.
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

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

// A planar profile, extruded from -half_height to half_height along z. Exact where the profile's
// distance is.
class Extrusion : public DistanceShape {
 public:
  struct Planar {
    double distance;
    Vector2d gradient;
  };
  explicit Extrusion(double half_height) : half_height_(half_height) {}
  virtual Planar PlanarAt(const Vector2d& p) const = 0;

  DistanceAt At(const Vector3d& x) const override {
    const auto [planar, planar_gradient] = PlanarAt(x.head<2>());
    const double axial = std::abs(x.z()) - half_height_;
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
  double half_height_;
};

// From the rim of a round hole, positive inside.
Extrusion::Planar FromHole(const Vector2d& p, const Vector2d& center, double hole_radius) {
  const Vector2d offset = p - center;
  const double radius = offset.norm();
  return {hole_radius - radius,
          radius > 0 ? Vector2d(-offset / radius) : Vector2d(-Vector2d::UnitX())};
}

// A rectangle with a round hole. The hole lies inside the rectangle, so the planar distance is the
// larger of the two, exactly.
class CutBox : public Extrusion {
 public:
  CutBox() : Extrusion(kHalf.z()) {}
  std::string name() const override { return "cutbox"; }
  int genus() const override { return 1; }
  Eigen::AlignedBox3d bounds() const override { return {-kHalf, kHalf}; }

  Planar PlanarAt(const Vector2d& p) const override {
    const Planar hole = FromHole(p, Vector2d::Zero(), kHoleRadius);
    const Vector2d sign(p.x() < 0 ? -1.0 : 1.0, p.y() < 0 ? -1.0 : 1.0);
    const Vector2d beyond = p.cwiseAbs() - kHalf.head<2>();
    const Vector2d outside = beyond.cwiseMax(0.0);
    const double rectangle = outside.norm() + std::min(beyond.maxCoeff(), 0.0);
    if (hole.distance > rectangle) return hole;
    if (outside.maxCoeff() > 0) {
      return {rectangle, Vector2d(outside.normalized().cwiseProduct(sign))};
    }
    const Vector2d axis = beyond.x() > beyond.y() ? Vector2d::UnitX() : Vector2d::UnitY();
    return {rectangle, Vector2d(axis.cwiseProduct(sign))};
  }

 private:
  static constexpr double kHoleRadius = 0.35;
  inline static const Vector3d kHalf{0.8, 0.6, 0.4};
};

// A polygon, counter-clockwise, with round holes that lie apart from each other and from its rim.
class Plate : public Extrusion {
 public:
  struct Hole {
    Vector2d center;
    double radius;
  };
  Plate(std::string name, const std::vector<Vector2d>& corners, std::vector<Hole> holes,
        double half_height)
      : Extrusion(half_height), name_(std::move(name)), holes_(std::move(holes)) {
    for (size_t i = 0; i < corners.size(); ++i) {
      const Vector2d &a = corners[i], &b = corners[(i + 1) % corners.size()];
      sides_.push_back({a, b, b - a, (b - a).squaredNorm()});
      bounds_.extend(Vector3d(a.x(), a.y(), -half_height));
      bounds_.extend(Vector3d(a.x(), a.y(), half_height));
    }
  }
  std::string name() const override { return name_; }
  int genus() const override { return static_cast<int>(holes_.size()); }
  Eigen::AlignedBox3d bounds() const override { return bounds_; }

  Planar PlanarAt(const Vector2d& p) const override {
    Planar nearest = FromPolygon(p);
    for (const Hole& hole : holes_) {
      const Planar rim = FromHole(p, hole.center, hole.radius);
      if (rim.distance > nearest.distance) nearest = rim;
    }
    return nearest;
  }

 private:
  Planar FromPolygon(const Vector2d& p) const {
    double nearest = std::numeric_limits<double>::infinity();
    Vector2d offset = Vector2d::Zero(), along = Vector2d::UnitY();
    bool inside = false;
    for (const auto& [a, b, edge, squared_length] : sides_) {
      const double t = std::clamp((p - a).dot(edge) / squared_length, 0.0, 1.0);
      const Vector2d away = p - (a + t * edge);
      if (away.squaredNorm() < nearest) {
        nearest = away.squaredNorm();
        offset = away;
        along = edge;
      }
      if ((a.y() > p.y()) != (b.y() > p.y()) &&
          p.x() < a.x() + (p.y() - a.y()) / edge.y() * edge.x()) {
        inside = !inside;
      }
    }
    const double distance = std::sqrt(nearest);
    const double sign = inside ? -1.0 : 1.0;
    // On the rim itself the offset is rounding.
    if (distance > 1e-12) return {sign * distance, sign * offset / distance};
    return {sign * distance, Vector2d(along.y(), -along.x()).normalized()};
  }

  struct Side {
    Vector2d a, b, edge;
    double squared_length;
  };

  std::string name_;
  std::vector<Side> sides_;
  std::vector<Hole> holes_;
  Eigen::AlignedBox3d bounds_;
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

ShapePtr MakeBracket() {
  const std::vector<Vector2d> corners = {{-0.8, -0.6}, {0.8, -0.6}, {0.8, -0.15}, {0.1, -0.15},
                                         {-0.3, 0.25}, {-0.3, 0.6}, {-0.8, 0.6}};
  const std::vector<Plate::Hole> holes = {
      {{-0.55, 0.35}, 0.13}, {{0.5, -0.38}, 0.12}, {{-0.4, -0.25}, 0.2}};
  return std::make_unique<Plate>("bracket", corners, holes, 0.2);
}

ShapePtr MakeThinWalls() {
  const std::vector<Vector2d> corners = {{-0.8, -0.5},  {0.8, -0.5},   {0.8, 0.5},   {0.76, 0.5},
                                         {0.76, -0.4},  {0.01, -0.4},  {0.01, 0.5},  {-0.01, 0.5},
                                         {-0.01, -0.4}, {-0.72, -0.4}, {-0.72, 0.5}, {-0.8, 0.5}};
  return std::make_unique<Plate>("thinwalls", corners, std::vector<Plate::Hole>(), 0.5);
}

}  // namespace rilievo
