// Scenes with a ground and things above it, whose sides are known.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "tests/scans/random.h"
#include "tests/unit/scan/scan_clouds.h"

namespace rilievo {

// What things are called: 1 is the one looked at, 2 what holds it.
inline constexpr int kGround = 0, kThing = 1, kHolder = 2;

// Points about 1 apart, with normals that face what is outside, or above.
class AirborneScene {
 public:
  explicit AirborneScene(double noise = 0) : noise_(noise) {}

  // A point each unit of u and v from the corner, bent along the normal by `height`.
  void AddSheet(int thing, const Eigen::Vector3d& corner, const Eigen::Vector3d& u,
                const Eigen::Vector3d& v,
                const std::function<double(double, double)>& height = nullptr) {
    const Eigen::Vector3d normal = u.cross(v).normalized();
    const double width = u.norm(), depth = v.norm(), jitter = 0.3, step = 1e-3;
    const auto at = [&](double x, double y) -> Eigen::Vector3d {
      return corner + u * (x / width) + v * (y / depth) + (height ? height(x, y) : 0) * normal;
    };
    for (double x = 0.5; x < width; ++x) {
      for (double y = 0.5; y < depth; ++y) {
        const double a = x + jitter * Signed(), b = y + jitter * Signed();
        const Eigen::Vector3d du = at(a + step, b) - at(a, b), dv = at(a, b + step) - at(a, b);
        Add(thing, at(a, b), du.cross(dv).normalized());
      }
    }
  }
  // 90 units wide; `bump` above the plane z = 0. `is_seen`: of x and y.
  void AddGround(const std::function<double(double, double)>& bump = nullptr,
                 const std::function<bool(double, double)>& is_seen = nullptr) {
    constexpr double kHalf = 45;
    const auto height = [&](double x, double y) {
      return std::sin(0.1 * x) + std::cos(0.12 * y) + (bump ? bump(x - kHalf, y - kHalf) : 0);
    };
    const size_t first = points_.size();
    AddSheet(kGround, {-kHalf, -kHalf, 0}, {2 * kHalf, 0, 0}, {0, 2 * kHalf, 0}, height);
    if (is_seen) KeepFrom(first, is_seen);
  }
  // Where nothing within `half` of the axis of z, along x and y, is seen.
  void AddGroundAround(double half_x, double half_y) {
    AddGround(nullptr,
              [=](double x, double y) { return std::abs(x) > half_x || std::abs(y) > half_y; });
  }
  // `keeps`: of directions from the centre. `side`: 1 outward.
  void AddBall(int thing, const Eigen::Vector3d& center, double radius,
               const std::function<bool(const Eigen::Vector3d&)>& keeps = nullptr, int side = 1) {
    const int count = static_cast<int>(4 * std::numbers::pi * radius * radius);
    for (int i = 0; i < count; ++i) {
      const double z = 1 - 2 * (i + 0.5) / count, angle = 2.399963 * i;
      const double around = std::sqrt(1 - z * z);
      const Eigen::Vector3d way(around * std::cos(angle), around * std::sin(angle), z);
      if (!keeps || keeps(way)) Add(thing, center + radius * way, side * way);
    }
  }
  // All six faces, or without the lower one.
  void AddBox(int thing, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
              bool has_bottom = true) {
    const Eigen::Vector3d size = to - from;
    const Eigen::Vector3d x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
    AddSheet(thing, from + z, x, y);
    if (has_bottom) AddSheet(thing, from, y, x);
    AddSheet(thing, from, x, z);
    AddSheet(thing, from + y, z, x);
    AddSheet(thing, from, z, y);
    AddSheet(thing, from + x, y, z);
  }
  // Upright.
  void AddPost(int thing, const Eigen::Vector3d& foot, double radius, double height) {
    for (double z = 0.5; z < height; ++z) {
      for (double angle = 0; angle < 2 * std::numbers::pi; angle += 1 / radius) {
        const Eigen::Vector3d way(std::cos(angle), std::sin(angle), 0);
        Add(thing, foot + radius * way + Eigen::Vector3d(0, 0, z), way);
      }
    }
  }

  KnownCloud Known() const {
    const auto count = static_cast<Eigen::Index>(points_.size());
    KnownCloud known;
    known.cloud.points = Eigen::Map<const Eigen::Matrix3Xd>(points_.data()->data(), 3, count);
    known.normals = Eigen::Map<const Eigen::Matrix3Xd>(normals_.data()->data(), 3, count);
    return known;
  }
  size_t size() const { return thing_.size(); }
  int thing(int point) const { return thing_[static_cast<size_t>(point)]; }

 private:
  double Signed() { return 2 * random_.Uniform() - 1; }
  void Add(int thing, const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    points_.push_back(point + noise_ * Eigen::Vector3d(Signed(), Signed(), Signed()));
    normals_.push_back(normal);
    thing_.push_back(thing);
  }

  void KeepFrom(size_t first, const std::function<bool(double, double)>& keeps) {
    size_t kept = first;
    for (size_t i = first; i < points_.size(); ++i) {
      if (!keeps(points_[i].x(), points_[i].y())) continue;
      points_[kept] = points_[i];
      normals_[kept] = normals_[i];
      thing_[kept++] = thing_[i];
    }
    points_.resize(kept);
    normals_.resize(kept);
    thing_.resize(kept);
  }

  double noise_;
  Random random_{7};
  std::vector<Eigen::Vector3d> points_, normals_;
  std::vector<int> thing_;
};

}  // namespace rilievo
