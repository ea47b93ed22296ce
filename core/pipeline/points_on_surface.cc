#include "core/pipeline/points_on_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "absl/status/status.h"
#include "core/base/parallel_for.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/geometry/vertex_normals.h"
#include "core/pipeline/settings.h"
#include "core/points/morton_order.h"
#include "core/points/settings.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

absl::StatusOr<Eigen::Matrix3Xd> FinitePoints(const PointCloud& scan, const SpatialFrame& frame,
                                              const RunContext& context) {
  Eigen::Matrix3Xd points(3, scan.points.cols());
  Eigen::Index count = 0;
  for (const auto point : scan.points.colwise()) {
    if (point.allFinite()) points.col(count++) = frame.UnitFromScan(point);
  }
  if (count == 0) {
    return absl::InvalidArgumentError("the scan has no point with finite coordinates");
  }
  points.conservativeResize(3, count);
  RILIEVO_ASSIGN_OR_RETURN(const MortonOrder order, ComputeMortonOrder(points, context));
  return Eigen::Matrix3Xd(points(Eigen::all, order.order));
}

// How `across` changes from one point to the next, which is mostly near it. Points beyond a border
// tell nothing.
double NoiseOf(const std::vector<float>& across) {
  std::vector<float> steps;
  for (size_t i = 1; i < across.size(); ++i) {
    if (across[i] == 0 || across[i - 1] == 0) continue;
    steps.push_back(std::abs(across[i] - across[i - 1]));
  }
  return double{Median(std::move(steps))} /
         (kPointsOnSurface.median_of_normal * std::numbers::sqrt2);
}

}  // namespace

absl::Status LayAgain(const Shape& surface, const std::vector<uint8_t>& again,
                      const RunContext& context, PointsOnSurface* points) {
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree,
                           ClosestPointTree::Over(surface.vertices, surface.triangles, context,
                                                  surface.children_per_face));
  return ParallelFor(points->points.cols(), kSearchBlock, context, [&](int64_t begin, int64_t end) {
    int hint = -1;
    for (int64_t i = begin; i < end; ++i) {
      if (!again.empty() && again[i] == 0) continue;
      const Eigen::Vector3d point = points->points.col(i);
      const ClosestPointTree::Hit hit = tree.Closest(point, hint);
      hint = hit.item;
      const int triangle = tree.source()[hit.item];
      const Eigen::Vector3d corner = surface.vertices.col(surface.triangles(0, triangle));
      const Eigen::Vector3d normal =
          FaceCross(surface.vertices, surface.triangles, triangle).normalized();
      points->away[i] = static_cast<float>(std::sqrt(hit.squared_distance));
      const double across = normal.dot(point - corner);
      const double along = std::sqrt(std::max(0.0, hit.squared_distance - across * across));
      points->across[i] =
          along > kPointsOnSurface.beyond * std::abs(across) ? 0 : static_cast<float>(across);
      points->triangle[i] = triangle;
    }
  });
}

absl::StatusOr<PointsOnSurface> LayOnSurface(const PointCloud& scan, const SpatialFrame& frame,
                                             const Shape& surface, const RunContext& context) {
  PointsOnSurface laid;
  RILIEVO_ASSIGN_OR_RETURN(laid.points, FinitePoints(scan, frame, context));
  laid.non_finite = scan.points.cols() - laid.points.cols();
  laid.away.resize(laid.points.cols());
  laid.across.resize(laid.points.cols());
  laid.triangle.resize(laid.points.cols());
  RILIEVO_RETURN_IF_ERROR(LayAgain(surface, {}, context, &laid));
  laid.noise = NoiseOf(laid.across);
  return laid;
}

ScannedPatches CompareWithSurface(const PointsOnSurface& points, const Shape& surface,
                                  double surface_error) {
  std::vector<int> counts;
  ScannedPatches patches;
  for (;; patches.triangles_each *= 4) {
    counts.assign(surface.triangles.cols() / patches.triangles_each, 0);
    for (const int triangle : points.triangle) ++counts[triangle / patches.triangles_each];
    std::vector<int> of_seen;
    std::copy_if(counts.begin(), counts.end(), std::back_inserter(of_seen),
                 [](int count) { return count > 0; });
    const bool largest = patches.triangles_each >= surface.children_per_face;
    if (largest || Median(std::move(of_seen)) >= kCommon.fewest_of_plane) break;
  }
  std::vector<std::vector<float>> across(counts.size());
  for (size_t p = 0; p < counts.size(); ++p) across[p].reserve(counts[p]);
  for (size_t i = 0; i < points.across.size(); ++i) {
    across[points.triangle[i] / patches.triangles_each].push_back(points.across[i]);
  }
  for (const int count : counts) patches.seen.push_back(count > 0 ? 1 : 0);
  const auto seen = std::count(patches.seen.begin(), patches.seen.end(), 1);
  const double deviations =
      std::sqrt(2 * std::log(static_cast<double>(std::max<int64_t>(2, seen))));
  const double noise = points.noise * points.noise, error = surface_error * surface_error;
  for (std::vector<float>& of_patch : across) {
    patches.contradicted.push_back(0);
    if (of_patch.size() < kCommon.fewest_witnesses) continue;
    const double of_median = std::numbers::pi / 2 * noise / static_cast<double>(of_patch.size());
    const double most = deviations * std::sqrt(of_median + error);
    patches.contradicted.back() = std::abs(Median(std::move(of_patch))) > most ? 1 : 0;
  }
  return patches;
}

DistanceSummary SummaryOf(const std::vector<float>& away) {
  DistanceSummary summary;
  summary.samples = static_cast<int64_t>(away.size());
  if (away.empty()) return summary;
  double squared = 0, sum = 0;
  for (const float distance : away) {
    squared += double{distance} * distance;
    sum += distance;
  }
  const auto count = static_cast<double>(away.size());
  summary.rms = std::sqrt(squared / count);
  summary.mean = sum / count;
  summary.p95 = Quantile(away, 0.95);
  summary.max = *std::max_element(away.begin(), away.end());
  return summary;
}

}  // namespace rilievo
