#include "core/control/topology/loop_support.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "core/control/topology/settings.h"
#include "core/points/settings.h"

namespace rilievo {

bool LoopSupport::PointsLine(std::span<const int> loop, const Eigen::Matrix3Xd& vertices,
                             const Eigen::Matrix3Xd& normals) const {
  double points_around = 0, agreement = 0;
  for (size_t i = 0; i < loop.size(); ++i) {
    const int v = loop[i];
    int found[kCommon.near_points];
    double squared[kCommon.near_points];
    const int count = index_.Nearest(vertices.col(v), std::min(kCommon.near_points, index_.size()),
                                     found, squared);
    double best = -1;
    for (int k = 0; k < count; ++k) {
      best = std::max(best, cloud_.normals.col(found[k]).dot(normals.col(v)));
    }
    agreement += best;
    points_around += (vertices.col(loop[(i + 1) % loop.size()]) - vertices.col(v)).norm() /
                     cloud_.spacing[found[0]];
  }
  return points_around >= kCommon.fewest_of_plane &&
         agreement >= kCommon.smooth_cosine * static_cast<double>(loop.size());
}

bool LoopSupport::PointsLeaveOpen(std::span<const int> loop,
                                  const Eigen::Matrix3Xd& vertices) const {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const int v : loop) center += vertices.col(v);
  center /= static_cast<double>(loop.size());
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector3d a = vertices.col(loop[i]) - center;
    const Eigen::Vector3d b = vertices.col(loop[(i + 1) % loop.size()]) - center;
    axis += a.cross(b);
  }
  axis.stableNormalize();
  // The nearest point where it is no farther than so many of its spacings, else -1.
  const auto point_within = [&](const Eigen::Vector3d& place, double spacings) {
    int found;
    double squared;
    if (index_.Nearest(place, 1, &found, &squared) < 1) return -1;
    return std::sqrt(squared) <= spacings * cloud_.spacing[found] ? found : -1;
  };
  const auto is_covered = [&](const Eigen::Vector3d& place) {
    const int point = point_within(place, kCommon.disc_spacings);
    return point >= 0 && std::abs(cloud_.normals.col(point).dot(axis)) >= kCommon.same_side;
  };
  int covered = 0, seen = 0;
  for (const int v : loop) {
    covered += is_covered((center + vertices.col(v)) / 2) ? 1 : 0;
    seen += point_within(vertices.col(v), kLoopSupport.seen_spacings) >= 0 ? 1 : 0;
  }
  const auto size = static_cast<double>(loop.size());
  return seen >= kLoopSupport.seen * size &&
         !(is_covered(center) && covered >= kLoopSupport.covered * size);
}

}  // namespace rilievo
