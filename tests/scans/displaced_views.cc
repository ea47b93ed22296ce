#include "tests/scans/displaced_views.h"

#include <cmath>
#include <numbers>

#include "tests/scans/random.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

Vector3d RandomDirection(Random* random) {
  const double z = random->Uniform(-1, 1), turn = random->Uniform(0, 2 * std::numbers::pi);
  const double ring = std::sqrt(1 - z * z);
  return {ring * std::cos(turn), ring * std::sin(turn), z};
}

Eigen::Isometry3d RandomMove(const Displacement& displacement, const Eigen::AlignedBox3d& box,
                             Random* random) {
  const Vector3d axis = RandomDirection(random);
  const double angle = displacement.degrees * std::numbers::pi / 180;
  const Vector3d way = displacement.share * box.diagonal().norm() * RandomDirection(random);
  return Eigen::Translation3d(box.center() + way) * Eigen::AngleAxisd(angle, axis) *
         Eigen::Translation3d(-box.center());
}

}  // namespace

std::vector<DisplacedView> DisplaceViews(const SimulatedScan& scan,
                                         const Displacement& displacement) {
  const Eigen::Matrix3Xd& points = scan.cloud.points;
  const Eigen::AlignedBox3d box(points.rowwise().minCoeff(), points.rowwise().maxCoeff());
  std::vector<DisplacedView> views;
  for (Eigen::Index v = 0; v < scan.viewpoints.cols(); ++v) {
    std::vector<int> columns;
    for (size_t i = 0; i < scan.view.size(); ++i) {
      if (scan.view[i] == v) columns.push_back(static_cast<int>(i));
    }
    DisplacedView& view = views.emplace_back();
    Random random(displacement.seed, static_cast<uint64_t>(v));
    view.moved = v == 0 ? Eigen::Isometry3d::Identity() : RandomMove(displacement, box, &random);
    view.cloud.points = view.moved * Eigen::Matrix3Xd(points(Eigen::all, columns));
    view.cloud.sights.stations = view.moved * Vector3d(scan.viewpoints.col(v));
    view.cloud.sights.station_of.assign(columns.size(), 0);
  }
  return views;
}

}  // namespace rilievo
