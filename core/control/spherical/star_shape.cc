#include "core/control/spherical/star_shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/parallel_sort.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/control/planar/plane_frame.h"
#include "core/control/planar/settings.h"
#include "core/control/planar/sheet_test.h"
#include "core/control/spherical/octahedron.h"
#include "core/control/spherical/settings.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

}  // namespace

Vector3d FindStarCenter(const OrientedCloud& cloud) {
  const int count = static_cast<int>(cloud.points.cols());
  Vector3d center = Vector3d::Zero();
  double area_sum = 0;
  for (int i = 0; i < count; ++i) {
    const double area = PointArea(cloud, i);
    center += area * cloud.points.col(i);
    area_sum += area;
  }
  if (!(area_sum > 0)) return center;
  center /= area_sum;
  // Each point whose normal leaves the ray by too much pulls the centre back along that normal.
  // Where no centre will do, the walk may leave the cloud: the best place of all is kept.
  const int stride = std::max(1, count / kStarShape.center_samples);
  Vector3d best = center;
  double least_weight = area_sum;
  for (int step = 0; step < kStarShape.center_steps; ++step) {
    Vector3d pull = Vector3d::Zero();
    double weight = 0;
    for (int i = 0; i < count; i += stride) {
      const Vector3d ray = cloud.points.col(i) - center;
      const double short_by = kStarShape.margin * ray.norm() - cloud.normals.col(i).dot(ray);
      if (short_by <= 0) continue;
      const double area = PointArea(cloud, i);
      pull -= area * short_by * cloud.normals.col(i);
      weight += area;
    }
    if (weight < least_weight) {
      least_weight = weight;
      best = center;
    }
    if (!(weight > 0) || pull.norm() < 1e-6 * weight) break;
    center += pull / weight;
  }
  return best;
}

absl::StatusOr<StarCheck> CheckStarShape(const OrientedCloud& cloud, const Vector3d& center,
                                         const RunContext& context) {
  StarCheck check;
  const int count = static_cast<int>(cloud.points.cols());
  const int levels = std::clamp(
      static_cast<int>(
          std::floor(std::log2(std::max(1.0, count / (8 * kStarShape.points_per_cell))) / 2)),
      1, 6);
  const Octahedron grid(levels);
  std::vector<std::pair<int, double>> by_cell(static_cast<size_t>(count));  // cell, log radius
  std::atomic<int64_t> outward = 0, radial = 0;
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, kLightBlock, context, [&](int64_t begin, int64_t end) {
    int64_t outward_here = 0, radial_here = 0;
    for (int64_t i = begin; i < end; ++i) {
      const Vector3d ray = cloud.points.col(i) - center;
      const double radius = std::max(ray.norm(), 1e-9);
      by_cell[i] = {grid.FaceOf(ray), std::log(radius)};
      const double cosine = cloud.normals.col(i).dot(ray) / radius;
      outward_here += cosine > 0 ? 1 : 0;
      radial_here += cosine > kStarShape.radial_cosine ? 1 : 0;
    }
    outward += outward_here;
    radial += radial_here;
  }));
  check.outward = static_cast<double>(outward.load()) / count;
  check.radial = static_cast<double>(radial.load()) / count;
  RILIEVO_RETURN_IF_ERROR(ParallelSort(std::less<>(), context, &by_cell));
  const double width = std::sqrt(4 * std::numbers::pi / static_cast<double>(grid.faces().cols()));
  std::vector<double> radii(by_cell.size());  // logarithms
  for (size_t i = 0; i < by_cell.size(); ++i) radii[i] = by_cell[i].second;
  int64_t cells = 0, split = 0;
  for (size_t begin = 0, end = 0; begin < by_cell.size(); begin = end) {
    for (end = begin; end < by_cell.size() && by_cell[end].first == by_cell[begin].first;) ++end;
    const std::span<const double> cell(radii.data() + begin, end - begin);
    ++cells;
    split += HasTwoSheets(cell, std::log1p(kSheetTest.sheet_gap * width)) ? 1 : 0;
  }
  check.coverage = static_cast<double>(cells) / static_cast<double>(grid.faces().cols());
  check.single_sheet = 1 - static_cast<double>(split) / static_cast<double>(cells);
  check.radius_ratio = std::exp(Quantile(radii, 0.99) - Quantile(radii, 0.01));
  return check;
}

}  // namespace rilievo
