#include "client/picture/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr double kMargin = 0.04;

Eigen::Matrix3d ViewFromScene(const Camera& camera) {
  const double turn = camera.turn_degrees * std::numbers::pi / 180;
  const double elevation = camera.elevation_degrees * std::numbers::pi / 180;
  // Written for z up; straight from above, up is the limit of the view from below it.
  Vector3d towards(std::cos(elevation) * std::cos(turn), std::cos(elevation) * std::sin(turn),
                   std::sin(elevation));
  Vector3d right(-std::sin(turn), std::cos(turn), 0);
  if (camera.up == UpAxis::kY) {
    towards = Vector3d(towards.y(), towards.z(), towards.x());
    right = Vector3d(right.y(), right.z(), right.x());
  }
  Eigen::Matrix3d view;
  view << right.transpose(), towards.cross(right).transpose(), towards.transpose();
  return view;
}

}  // namespace

Projection::Projection(const Camera& camera, const Eigen::Matrix3Xd& points, int width, int height)
    : perspective_(camera.perspective),
      view_from_scene_(ViewFromScene(camera)),
      half_width_(0.5 * width),
      half_height_(0.5 * height) {
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3d p = view_from_scene_ * points.col(i);
    if (!p.allFinite()) continue;
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  if (!low.allFinite()) low = high = Vector3d::Zero();
  center_ = 0.5 * low + 0.5 * high;
  scale_ = 0.5 * (high - low).norm();
  if (!(scale_ > 0) || !std::isfinite(scale_)) scale_ = 1;

  const double room = (1 - 2 * kMargin);
  if (!perspective_) {
    const Vector3d half = 0.5 * (high - low) / scale_;
    focal_pixels_ = room * std::min(half_width_ / std::max(half.x(), 1e-9),
                                    half_height_ / std::max(half.y(), 1e-9));
  } else {
    const double tangent = std::tan(0.5 * camera.field_of_view_degrees * std::numbers::pi / 180);
    focal_pixels_ = std::min(half_width_, half_height_) / tangent;
    const double tangent_x = room * half_width_ / focal_pixels_;
    const double tangent_y = room * half_height_ / focal_pixels_;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      const Vector3d p = (view_from_scene_ * points.col(i) - center_) / scale_;
      if (!p.allFinite()) continue;
      distance_ = std::max({distance_, p.z() + std::abs(p.x()) / tangent_x,
                            p.z() + std::abs(p.y()) / tangent_y, p.z() + 0.01});
    }
  }
}

Projected Projection::Project(const Vector3d& point) const {
  const Vector3d p = (view_from_scene_ * point - center_) / scale_;
  const double nearness = perspective_ ? 1.0 / std::max(distance_ - p.z(), 1e-3) : p.z();
  const double factor = perspective_ ? focal_pixels_ * nearness : focal_pixels_;
  return {static_cast<float>(half_width_ + factor * p.x()),
          static_cast<float>(half_height_ - factor * p.y()), static_cast<float>(nearness)};
}

Vector3d Projection::TowardsCamera(const Vector3d& point) const {
  if (!perspective_) return Vector3d::UnitZ();
  const Vector3d p = (view_from_scene_ * point - center_) / scale_;
  return (Vector3d(0, 0, distance_) - p).normalized();
}

double Projection::scaled_units_per_sample() const {
  return perspective_ ? std::max(distance_, 0.01) / focal_pixels_ : 1 / focal_pixels_;
}

float Projection::HeightFromNearness(float nearness) const {
  return perspective_ ? static_cast<float>(distance_ - 1.0 / nearness) : nearness;
}

Eigen::Matrix3Xd CylinderAround(const Eigen::Matrix3Xd& points, const Camera& camera) {
  const int up = camera.up == UpAxis::kY ? 1 : 2;
  Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    if (!points.col(i).allFinite()) continue;
    low = low.cwiseMin(points.col(i));
    high = high.cwiseMax(points.col(i));
  }
  if (!low.allFinite()) return Eigen::Matrix3Xd::Zero(3, 1);
  const Vector3d center = 0.5 * low + 0.5 * high;
  double radius = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    Vector3d across = points.col(i) - center;
    across(up) = 0;
    if (across.allFinite()) radius = std::max(radius, across.norm());
  }
  constexpr int kAround = 64;
  Eigen::Matrix3Xd ring(3, 2 * kAround);
  for (int i = 0; i < kAround; ++i) {
    // Turned with the camera, so that it looks the same from every side.
    const double angle = (camera.turn_degrees / 180 + 2.0 * i / kAround) * std::numbers::pi;
    for (int end = 0; end < 2; ++end) {
      Vector3d place = center;
      place((up + 1) % 3) += radius * std::cos(angle);
      place((up + 2) % 3) += radius * std::sin(angle);
      place(up) = end == 0 ? low(up) : high(up);
      ring.col(2 * i + end) = place;
    }
  }
  return ring;
}

}  // namespace rilievo
