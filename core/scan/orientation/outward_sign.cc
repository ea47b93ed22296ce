#include "core/scan/orientation/outward_sign.h"

#include <algorithm>
#include <cmath>

#include "core/points/settings.h"
#include "core/scan/orientation/dipole.h"
#include "core/scan/orientation/settings.h"

namespace rilievo {

double MeanWinding(const WindingField& field, const OrientedCloud& cloud,
                   std::span<const int> members) {
  const size_t samples = std::min<size_t>(kCommon.sampled_points, members.size());
  double sum = 0, weight = 0;
  for (size_t s = 0; s < samples; ++s) {
    const int i = members[s * members.size() / samples];
    const double share = ShareOfSurface(cloud.spacing[i]);
    sum += share * field.At(cloud.points.col(i));
    weight += share;
  }
  return weight > 0 ? sum / weight : 0;
}

int OwnOutwardSign(const OrientedCloud& cloud, std::span<const int> members) {
  const WindingField field(cloud, {members.begin(), members.end()});
  const double winding = MeanWinding(field, cloud, members);
  if (std::abs(winding) > kOutwardSign.closed) return winding < 0 ? -1 : 1;

  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double weight = 0;
  for (const int i : members) {
    const double share = ShareOfSurface(cloud.spacing[i]);
    center += share * cloud.points.col(i);
    weight += share;
  }
  if (weight > 0) center /= weight;
  double volume = 0, lever = 0;
  for (const int i : members) {
    const double share = ShareOfSurface(cloud.spacing[i]);
    const Eigen::Vector3d arm = cloud.points.col(i) - center;
    volume += share * arm.dot(cloud.normals.col(i));
    lever += share * arm.norm();
  }
  if (std::abs(volume) > kOutwardSign.convex * lever) return volume < 0 ? -1 : 1;
  return 0;
}

int OutwardSign(const OrientedCloud& cloud, std::span<const int> members) {
  if (const int own = OwnOutwardSign(cloud, members); own != 0) return own;
  Eigen::Vector3d area = Eigen::Vector3d::Zero();
  for (const int i : members) area += ShareOfSurface(cloud.spacing[i]) * cloud.normals.col(i);
  for (const int axis : {2, 1, 0}) {
    if (std::abs(area[axis]) > 0.3 * area.norm()) return area[axis] < 0 ? -1 : 1;
  }
  return 1;
}

}  // namespace rilievo
