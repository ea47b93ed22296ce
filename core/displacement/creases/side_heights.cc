#include "core/displacement/creases/side_heights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/ablation.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kNearest = 32;
// Least cosine of the normals of a point and of its side.
constexpr double kOwnSide = 0.75;
// Points count by a Gaussian of so many spacings.
constexpr double kReachSpacings = 2.0;

struct Side {
  double offset = 0, weight = 0, square = 0;
};

}  // namespace

std::optional<HeightEstimate> MeetAlongRay(const RayCloud& cloud, const PointIndex& index,
                                           const Vector3d& position, const Vector3d& direction,
                                           const Eigen::Matrix3Xd& side_normals) {
  if (IsLeftOut(Mechanism::kSideHeights)) return std::nullopt;
  std::array<int, kNearest> found;
  std::array<double, kNearest> squared;
  const int count =
      index.Nearest(position, std::min(kNearest, index.size()), found.data(), squared.data());
  std::vector<Side> sides(static_cast<size_t>(side_normals.cols()));
  const RayPoint& nearest = cloud.points[found[0]];
  for (int i = 0; i < count; ++i) {
    const RayPoint& point = cloud.points[found[i]];
    const Vector3d normal = Eigen::Map<const Eigen::Vector3f>(point.normal).cast<double>();
    Eigen::Index best = 0;
    const double agreement = (side_normals.transpose() * normal).maxCoeff(&best);
    if (!(agreement > kOwnSide)) continue;  // also the NaN of an outlier
    const Vector3d way =
        Eigen::Map<const Eigen::Vector3f>(point.position).cast<double>() - position;
    // Halfway between the two normals: exact on spheres.
    const double offset = (normal + side_normals.col(best)).normalized().dot(way);
    const double reach = kReachSpacings * point.spacing;
    const double aside = std::max(0.0, way.squaredNorm() - offset * offset);
    const double weight = std::exp(-aside / (2 * reach * reach)) * std::pow(agreement, 8);
    Side& side = sides[static_cast<size_t>(best)];
    side.offset += weight * offset;
    side.weight += weight;
    side.square += weight * weight;
  }
  double right = 0, left = 0, variance = 0;
  int seen = 0;
  for (size_t k = 0; k < sides.size(); ++k) {
    if (!(sides[k].weight > 1e-3)) continue;
    const double slope = direction.dot(side_normals.col(static_cast<Eigen::Index>(k)));
    right += slope * sides[k].offset / sides[k].weight;
    left += slope * slope;
    variance += slope * slope * sides[k].square / (sides[k].weight * sides[k].weight);
    ++seen;
  }
  if (seen < 2 || !(left > 0.05)) return std::nullopt;
  return HeightEstimate{static_cast<float>(right / left),
                        static_cast<float>(nearest.noise * std::sqrt(variance) / left),
                        nearest.spacing,
                        found[0],
                        true,
                        true};
}

}  // namespace rilievo
