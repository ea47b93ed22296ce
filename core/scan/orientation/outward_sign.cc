#include "core/scan/orientation/outward_sign.h"

#include <cmath>

namespace rilievo {
namespace {

// Sums over the points of a component; each stands for spacing^2 of surface.
struct Part {
  double size = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero(), area = Eigen::Vector3d::Zero();
  double volume = 0, lever = 0;  // of the points from the centre, along their normals and in all
};

int OutwardSign(const Part& part) {
  // Area that does not cancel out, against all of it: a closed part has next to none.
  constexpr double kClosed = 0.1;
  // Volume against the most that so large a part could have: a hemisphere has more than one half.
  constexpr double kConvex = 0.4;
  const auto sign = [](double value) { return value < 0 ? -1 : 1; };
  const double uncancelled = part.area.norm();
  if (uncancelled < kClosed * part.size || std::abs(part.volume) > kConvex * part.lever) {
    return sign(part.volume);
  }
  Eigen::Index axis = 2;
  if (std::abs(part.area.z()) < 0.3 * uncancelled) part.area.cwiseAbs().maxCoeff(&axis);
  return sign(part.area[axis]);
}

}  // namespace

std::vector<int> OutwardSigns(const OrientedCloud& cloud, const std::vector<int>& component,
                              int count) {
  std::vector<Part> parts(static_cast<size_t>(count));
  for (size_t i = 0; i < component.size(); ++i) {
    const auto point = static_cast<Eigen::Index>(i);
    const double share = double{cloud.spacing[i]} * cloud.spacing[i];
    Part& part = parts[component[i]];
    part.size += share;
    part.center += share * cloud.points.col(point);
    part.area += share * cloud.normals.col(point);
  }
  for (Part& part : parts) part.center /= part.size;
  for (size_t i = 0; i < component.size(); ++i) {
    const auto point = static_cast<Eigen::Index>(i);
    const double share = double{cloud.spacing[i]} * cloud.spacing[i];
    Part& part = parts[component[i]];
    const Eigen::Vector3d arm = cloud.points.col(point) - part.center;
    part.volume += share * arm.dot(cloud.normals.col(point));
    part.lever += share * arm.norm();
  }
  std::vector<int> signs;
  for (const Part& part : parts) signs.push_back(OutwardSign(part));
  return signs;
}

}  // namespace rilievo
