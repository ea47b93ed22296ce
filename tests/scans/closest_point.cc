#include "tests/scans/closest_point.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

namespace rilievo {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kTangentialRounds = 40;
constexpr int kNewtonRounds = 30;
constexpr double kConverged = 1e-14;  // step, in units of the diagonal

Vector3d ProjectAlongGradient(const AnalyticShape& shape, Vector3d p) {
  for (int round = 0; round < 4; ++round) {
    const Vector3d gradient = shape.Gradient(p);
    const double step = shape.Field(p) / gradient.squaredNorm();
    p -= step * gradient;
    if (std::abs(step) < kConverged) break;
  }
  return p;
}

// Returns whether the steps died out.
bool TangentialSteps(const AnalyticShape& shape, const Vector3d& x, double scale, Vector3d* p) {
  double last = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kTangentialRounds; ++round) {
    *p = ProjectAlongGradient(shape, *p);
    const Vector3d normal = shape.Gradient(*p).normalized();
    const Vector3d tangential = (x - *p) - normal * normal.dot(x - *p);
    const double length = tangential.norm();
    if (length < kConverged * scale) return true;
    if (round > 4 && length > 0.7 * last) return false;
    last = length;
    // A long tangential step would leave the surface's neighbourhood.
    *p += tangential * std::min(1.0, 0.05 * scale / length);
  }
  return false;
}

Matrix3d HessianByDifferences(const AnalyticShape& shape, const Vector3d& p, double scale) {
  const double h = 1e-5 * scale;
  Matrix3d hessian;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d offset = h * Vector3d::Unit(axis);
    hessian.col(axis) = (shape.Gradient(p + offset) - shape.Gradient(p - offset)) / (2 * h);
  }
  return 0.5 * (hessian + hessian.transpose());
}

void NewtonSteps(const AnalyticShape& shape, const Vector3d& x, double scale, Vector3d* p) {
  const Vector3d start = *p;
  const Vector3d first_gradient = shape.Gradient(*p);
  double lambda = (x - *p).dot(first_gradient) / first_gradient.squaredNorm();
  for (int round = 0; round < kNewtonRounds; ++round) {
    const Vector3d gradient = shape.Gradient(*p);
    Eigen::Matrix4d jacobian = Eigen::Matrix4d::Zero();
    jacobian.topLeftCorner<3, 3>() =
        Matrix3d::Identity() + lambda * HessianByDifferences(shape, *p, scale);
    jacobian.topRightCorner<3, 1>() = gradient;
    jacobian.bottomLeftCorner<1, 3>() = gradient.transpose();
    Eigen::Vector4d residual;
    residual << *p - x + lambda * gradient, shape.Field(*p);
    const Eigen::Vector4d step = jacobian.fullPivLu().solve(-residual);
    if (!step.allFinite()) break;
    const double damping = std::min(1.0, 0.1 * scale / std::max(step.head<3>().norm(), 1e-300));
    *p += damping * step.head<3>();
    lambda += damping * step(3);
    if (step.head<3>().norm() < kConverged * scale) break;
  }
  // Newton may run to a farther stationary point; the start is on the surface and always valid.
  if (!p->allFinite() || (*p - x).norm() > (start - x).norm()) *p = start;
  *p = ProjectAlongGradient(shape, *p);
}

}  // namespace

Vector3d ClosestPointOnImplicit(const AnalyticShape& shape, const Vector3d& x,
                                std::span<const Vector3d> starts) {
  const double scale = shape.diagonal();
  Vector3d best = starts.front();
  double best_distance = std::numeric_limits<double>::infinity();
  for (const Vector3d& start : starts) {
    Vector3d p = start;
    if (!TangentialSteps(shape, x, scale, &p)) {
      p = ProjectAlongGradient(shape, p);
      NewtonSteps(shape, x, scale, &p);
    }
    const double distance = (p - x).norm();
    if (distance < best_distance) {
      best = p;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace rilievo
