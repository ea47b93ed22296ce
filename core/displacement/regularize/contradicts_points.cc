#include "core/displacement/regularize/contradicts_points.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/base/ablation.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

constexpr int kNearest = 12;
constexpr int kAmid = 8;
constexpr double kAmidSpacings = 0.6, kAmidNoises = 0.7;
constexpr int kFacing = 5, kLeastFacing = 3;
constexpr double kOffSpacings = 0.25, kOffNoises = 1.5;

Vector3d Position(const RayPoint& point) {
  return Eigen::Map<const Eigen::Vector3f>(point.position).cast<double>();
}

}  // namespace

bool ContradictsPoints(const RayCloud& cloud, const PointIndex& index, const Vector3d& place,
                       const Vector3d& direction) {
  if (IsLeftOut(Mechanism::kContradictsPoints)) return false;
  std::array<int, kNearest> found;
  std::array<double, kNearest> squared;
  const int count =
      index.Nearest(place, std::min(kNearest, index.size()), found.data(), squared.data());
  const int amid = std::min(count, kAmid);
  Vector3d mean = Vector3d::Zero();
  for (int i = 0; i < amid; ++i) mean += Position(cloud.points[found[i]]) / amid;
  const RayPoint& nearest = cloud.points[found[0]];
  const double most = kAmidSpacings * nearest.spacing + kAmidNoises * nearest.noise;
  if ((mean - place).norm() > most) return true;
  std::array<double, kFacing> off;
  int facing = 0;
  for (int i = 0; i < count && facing < kFacing; ++i) {
    const RayPoint& point = cloud.points[found[i]];
    const Vector3d normal = Eigen::Map<const Eigen::Vector3f>(point.normal).cast<double>();
    if (!(normal.dot(direction) > 0)) continue;  // also the NaN of an outlier
    const double least = kOffSpacings * point.spacing + kOffNoises * point.noise;
    off[facing++] = std::abs(normal.dot(place - Position(point))) / least;
  }
  if (facing < kLeastFacing) return false;
  std::nth_element(off.begin(), off.begin() + facing / 2, off.begin() + facing);
  return off[facing / 2] > 1;
}

}  // namespace rilievo
