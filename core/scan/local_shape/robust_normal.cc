#include "core/scan/local_shape/robust_normal.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/points/height_field.h"
#include "core/points/settings.h"
#include "core/scan/local_shape/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

using Heights = Eigen::Array<double, HeightFieldRows(kRobustNormal.most_points), 1>;

// How far off a surface a point may lie, squared. Between fine and coarse its logarithm counts, so
// that of two sides the one that points lie on exactly wins over the one that they lie by.
struct Tolerance {
  double fine, coarse;
};

Tolerance ToleranceOf(double spacing, double noise) {
  const double fine = kRobustNormal.fine_spacings * spacing + noise;
  const double coarse =
      std::max(kRobustNormal.coarse_spacings * spacing, kCommon.noise_deviations * noise);
  return {fine * fine, coarse * coarse};
}

// Points as seen from the first of them. Rows from `count` on are zero.
struct Patch {
  Heights x = Heights::Zero(), y = Heights::Zero(), z = Heights::Zero();
  Heights squared_distance = Heights::Zero();
  int count = 1;
  double radius = 0;

  Patch(const Eigen::Matrix3Xd& points, int center, std::span<const int> neighbors) {
    for (const int j :
         neighbors.first(std::min<size_t>(neighbors.size(), kRobustNormal.most_points - 1))) {
      const Vector3d offset = points.col(j) - points.col(center);
      x[count] = offset.x();
      y[count] = offset.y();
      z[count] = offset.z();
      squared_distance[count] = offset.squaredNorm();
      ++count;
    }
    radius = std::sqrt(squared_distance.maxCoeff());
  }
  Vector3d offset(int i) const { return {x[i], y[i], z[i]}; }
  Heights Along(const Vector3d& axis) const { return axis.x() * x + axis.y() * y + axis.z() * z; }
  Heights ones() const {
    Heights result = Heights::Zero();
    result.head(count).setOnes();
    return result;
  }
};

// The product over the points of (h^2 + fine) / (coarse + fine), none above 1: small where many lie
// on the surface.
class Misfit {
 public:
  Misfit(const Tolerance& tolerance, const Patch& patch)
      : fine_(tolerance.fine),
        share_(1 / (tolerance.coarse + tolerance.fine)),
        beyond_(1 - patch.ones()) {}
  double operator()(const Heights& heights) const {
    return ((heights.square() + fine_) * share_ + beyond_).min(1).prod();
  }
  // Of a point on the surface.
  double of_one() const { return fine_ * share_; }

 private:
  double fine_, share_;
  Heights beyond_;
};

struct HeightField {
  Vector3d normal;  // unit, where the point is
  Heights residuals;
};

// Least squares over the plane of `axis`: 3 terms are a plane, 6 a quadric.
template <int kTerms>
HeightField Fit(const Patch& patch, const Vector3d& axis, const Heights& weights) {
  const Vector3d u = axis.unitOrthogonal();
  const Vector3d v = axis.cross(u);
  const double scale = 1 / patch.radius;
  const Heights x = scale * patch.Along(u), y = scale * patch.Along(v);
  const Heights z = scale * patch.Along(axis);
  const HeightFieldSums sums =
      SumHeights({x.data(), y.data(), z.data(), weights.data(), patch.count});
  const Eigen::Matrix<double, kTerms, 1> terms =
      FitHeights<kTerms>(sums, kHeightField.ridge * weights.maxCoeff());
  Heights field = terms[0] + terms[1] * x + terms[2] * y;
  if constexpr (kTerms == 6) field += x * (terms[3] * x + terms[4] * y) + terms[5] * y * y;
  return {(axis - terms[1] * u - terms[2] * v).normalized(),
          patch.radius * patch.ones() * (z - field)};
}

// Weights of the points within the coarse tolerance: 1 / h^2, under which least squares are those
// of the logarithm.
Heights Weights(const Heights& heights, const Tolerance& tolerance, const Patch& patch) {
  const double kFlatten =
      kCommon.noise_deviations * kCommon.noise_deviations;  // no single point decides
  return patch.ones() * (heights.square() < tolerance.coarse)
                            .select(tolerance.fine / (heights.square() + kFlatten * tolerance.fine),
                                    kRobustNormal.least_weight);
}

// Of the planes through the point and two of the nearest kRobustNormal.nearest the one that fits
// best.
Vector3d BestPlane(const Patch& patch, const Misfit& misfit, const Vector3d& fallback) {
  double least = 2;
  Vector3d best = fallback;
  const int end = std::min(kRobustNormal.nearest + 1, patch.count);
  for (int a = 1; a < end; ++a) {
    for (int b = a + 1; b < end; ++b) {
      const Vector3d across = patch.offset(a).cross(patch.offset(b));
      const double square = across.squaredNorm();
      const double sides = patch.squared_distance[a] * patch.squared_distance[b];
      if (square <= kRobustNormal.sine * kRobustNormal.sine * sides) continue;
      const Vector3d normal = across / std::sqrt(square);
      const double of_plane = misfit(patch.Along(normal));
      if (of_plane >= least) continue;
      least = of_plane;
      best = normal;
    }
  }
  return best;
}

}  // namespace

Vector3d RobustNormal(const Eigen::Matrix3Xd& points, int center, std::span<const int> neighbors,
                      double spacing, double noise, const Vector3d& normal) {
  if (neighbors.size() < kRobustNormal.fewest_robust_neighbors) return normal;
  const Patch patch(points, center, neighbors);
  if (!(patch.radius > 0)) return normal;
  const Tolerance tolerance = ToleranceOf(spacing, noise);
  const HeightField whole = Fit<6>(patch, normal, patch.ones());
  if (whole.residuals.square().sum() < patch.count * tolerance.fine) return whole.normal;

  const Misfit misfit(tolerance, patch);
  const Vector3d plane = BestPlane(patch, misfit, normal);
  const HeightField side = Fit<3>(patch, plane, Weights(patch.Along(plane), tolerance, patch));
  HeightField bent_side = Fit<6>(patch, side.normal, Weights(side.residuals, tolerance, patch));
  bent_side = Fit<6>(patch, side.normal, Weights(bent_side.residuals, tolerance, patch));
  // Each term of a quadric beyond those of a plane could pass one point more.
  const double more_terms = std::pow(misfit.of_one(), 3 - kQuadricTerms);
  const double of_whole = misfit(whole.residuals) * more_terms;
  const double of_side = misfit(side.residuals);
  const double of_bent_side = misfit(bent_side.residuals) * more_terms;
  if (of_whole <= of_side && of_whole <= of_bent_side) return whole.normal;
  return of_side <= of_bent_side ? side.normal : bent_side.normal;
}

}  // namespace rilievo
