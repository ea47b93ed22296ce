#include "tests/scans/ray_cast.h"

#include <cmath>

namespace rilievo {
namespace {

constexpr double kLeastStep = 1e-6;  // of the diagonal

// The root in [low, high], where the field has opposite signs: regula falsi, Illinois variant,
// which keeps the bracket.
double RefineRoot(const AnalyticShape& shape, const Ray& ray, double low, double f_low, double high,
                  double f_high) {
  const auto field = [&](double t) { return shape.Field(ray.origin + t * ray.direction); };
  int side = 0;
  for (int round = 0; round < 100; ++round) {
    const double t = (low * f_high - high * f_low) / (f_high - f_low);
    const double f = field(t);
    if (f == 0 || high - low < 1e-15 * (1 + std::abs(high))) return t;
    if ((f > 0) == (f_low > 0)) {
      if (std::abs(t - low) < 1e-16 * (1 + std::abs(t))) return t;
      low = t;
      f_low = f;
      if (side == -1) f_high *= 0.5;
      side = -1;
    } else {
      if (std::abs(t - high) < 1e-16 * (1 + std::abs(t))) return t;
      high = t;
      f_high = f;
      if (side == 1) f_low *= 0.5;
      side = 1;
    }
  }
  return 0.5 * (low + high);
}

}  // namespace

std::vector<double> RayCrossings(const AnalyticShape& shape, const Ray& ray, double t_end,
                                 int limit) {
  const auto at = [&](double t) { return Eigen::Vector3d(ray.origin + t * ray.direction); };
  const double least_step = kLeastStep * shape.diagonal();
  std::vector<double> crossings;
  double t = 0, field = shape.Field(ray.origin);
  while (t < t_end && static_cast<int>(crossings.size()) < limit) {
    const double next = t + shape.SafeStep(at(t), field) + least_step;
    const double next_field = shape.Field(at(next));
    if ((field > 0) != (next_field > 0)) {
      const double root = RefineRoot(shape, ray, t, field, next, next_field);
      if (root < t_end && shape.Contains(at(root))) crossings.push_back(root);
    }
    t = next;
    field = next_field;
  }
  return crossings;
}

}  // namespace rilievo
