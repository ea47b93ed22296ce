#include "core/scan/local_shape/estimate_normals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/parallel_for_each.h"
#include "core/base/quantile.h"
#include "core/base/status_macros.h"
#include "core/points/settings.h"
#include "core/scan/local_shape/adaptive_patches.h"
#include "core/scan/local_shape/measurement_noise.h"
#include "core/scan/local_shape/patch_moments.h"
#include "core/scan/local_shape/quadric_residual.h"
#include "core/scan/local_shape/robust_normal.h"
#include "core/scan/local_shape/settings.h"

namespace rilievo {
namespace {

// The mean over the outer half of the list: the share of the j-th neighbour's disc is
// pi d_j^2 / j = pi/4 spacing^2. Near neighbours on one scan line say little of the surface.
float LocalSpacing(std::span<const float> distances) {
  const size_t first = distances.size() / 2;
  double sum = 0;
  for (size_t j = first; j < distances.size(); ++j) {
    sum += 4.0 * distances[j] * distances[j] / static_cast<double>(j + 1);
  }
  return static_cast<float>(std::sqrt(sum / static_cast<double>(distances.size() - first)));
}

// Where a patch bends over an edge, the plane of a neighbouring patch that holds the point and is
// much flatter (Kuwahara's choice of the quietest window, for planes): edges stay sharp.
Eigen::Vector3d SharpNormal(const Eigen::Matrix3Xd& points, const NeighborGraph& graph,
                            const std::vector<PatchMoments>& patches,
                            const std::vector<PatchPlane>& planes, double noise, int i) {
  if (IsLeftOut(Mechanism::kQuietestPatch)) return planes[i].normal;
  const double own = planes[i].thickness;
  if (own <= kEstimateNormals.bend_ratio * noise * noise || own < 1e-6 * planes[i].spread) {
    return planes[i].normal;
  }
  double best = kEstimateNormals.flatter_ratio * own;
  Eigen::Vector3d normal = planes[i].normal;
  for (const int j : graph.neighbors(i)) {
    const Eigen::Vector3d to_mean =
        points.col(j) - points.col(i) + patches[j].mean_offset.cast<double>();
    const double off_plane = planes[j].normal.dot(to_mean);
    const double cost = planes[j].thickness + off_plane * off_plane;
    if (cost >= best) continue;
    best = cost;
    normal = planes[j].normal;
  }
  return normal;
}

bool IsClean(float noise, float spacing) { return noise <= kCommon.clean_noise * spacing; }

// The noisy points whose patches are thicker than their noise makes them.
std::vector<NearEdgePoint> NearEdgePoints(const std::vector<PatchPlane>& planes,
                                          const std::vector<float>& noise,
                                          const std::vector<float>& spacing) {
  std::vector<NearEdgePoint> near_edge;
  for (size_t i = 0; i < planes.size(); ++i) {
    if (IsClean(noise[i], spacing[i]) || noise[i] >= kCommon.thick_noise_ratio * spacing[i])
      continue;
    if (planes[i].thickness <= kEstimateNormals.thicker * noise[i] * noise[i]) continue;
    near_edge.push_back({static_cast<int>(i), noise[i]});
  }
  return near_edge;
}

// `noise`: measurement noise at each point; `planes`: of the patches.
absl::Status ChooseNormals(const NeighborGraph& graph, const ReplacedLists& replaced,
                           const std::vector<PatchMoments>& patches,
                           const std::vector<PatchPlane>& planes, const std::vector<float>& noise,
                           const RunContext& context, OrientedCloud* cloud) {
  const Eigen::Matrix3Xd& points = cloud->points;
  const int64_t count = points.cols();
  cloud->normals.resize(3, count);
  const auto is_clean = [&](int64_t i) {
    return !IsLeftOut(Mechanism::kRobustNormal) &&
           graph.k >= kRobustNormal.fewest_robust_neighbors && IsClean(noise[i], cloud->spacing[i]);
  };
  const auto clean_normal = [&](int i, std::span<const int> neighbors) {
    if (planes[i].thickness <= kEstimateNormals.flat * noise[i] * noise[i]) return planes[i].normal;
    return RobustNormal(points, i, neighbors, cloud->spacing[i], noise[i], planes[i].normal);
  };
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kSearchBlock, context, [&](int64_t i) {
    const int center = static_cast<int>(i);
    cloud->normals.col(i) = is_clean(i)
                                ? clean_normal(center, graph.neighbors(center))
                                : SharpNormal(points, graph, patches, planes, noise[i], center);
  }));
  // On the rim of a wall both layers are its neighbours.
  const auto replaced_count = static_cast<int64_t>(replaced.points.size());
  return ParallelForEach(replaced_count, kSearchBlock, context, [&](int64_t r) {
    const int i = replaced.points[r];
    if (is_clean(i)) cloud->normals.col(i) = clean_normal(i, replaced.list(r, graph.k));
  });
}

}  // namespace

absl::StatusOr<EstimatedNormals> EstimateNormals(Eigen::Matrix3Xd own_points,
                                                 const NeighborGraph& graph,
                                                 const ReplacedLists& replaced,
                                                 const SpatialFrame& curve,
                                                 const RunContext& context) {
  EstimatedNormals estimated;
  OrientedCloud& cloud = estimated.cloud;
  cloud.points = std::move(own_points);
  const Eigen::Matrix3Xd& points = cloud.points;
  const int64_t count = points.cols();
  cloud.spacing.resize(static_cast<size_t>(count));
  cloud.noise.resize(static_cast<size_t>(count));
  RILIEVO_ASSIGN_OR_RETURN(std::vector<PatchMoments> patches,
                           ComputePatchMoments(points, graph, context));
  std::vector<PatchPlane> planes(static_cast<size_t>(count));
  std::vector<double> first_spread(static_cast<size_t>(count));
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kSearchBlock, context, [&](int64_t i) {
    const int center = static_cast<int>(i);
    const std::vector<float> distances = NeighborDistances(points, graph, center);
    planes[i] = FitPlane(patches[i]);
    first_spread[i] = planes[i].spread;
    cloud.spacing[i] = LocalSpacing(distances);
    cloud.noise[i] = static_cast<float>(QuadricResidual(points, center, graph.neighbors(center),
                                                        distances.back(), planes[i].normal));
  }));
  RILIEVO_ASSIGN_OR_RETURN(std::vector<float> noise,
                           MeasurementNoise(points, curve, cloud.noise, context));
  RILIEVO_RETURN_IF_ERROR(
      AdaptPatches(points, graph, noise, cloud.spacing, context, &patches, &planes));
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kSearchBlock, context, [&](int64_t i) {
    // Where patches had to be widened, the nearest neighbours are the nearest in height too
    // and show too little of the noise.
    if (planes[i].spread < kEstimateNormals.widened * first_spread[i]) return;
    cloud.noise[i] = std::max(cloud.noise[i], static_cast<float>(std::sqrt(planes[i].thickness)));
  }));
  first_spread = std::vector<double>();
  RILIEVO_ASSIGN_OR_RETURN(noise, MeasurementNoise(points, curve, cloud.noise, context));
  RILIEVO_RETURN_IF_ERROR(ChooseNormals(graph, replaced, patches, planes, noise, context, &cloud));
  estimated.near_edge = NearEdgePoints(planes, noise, cloud.spacing);
  RILIEVO_RETURN_IF_ERROR(ParallelForEach(count, kSearchBlock, context, [&](int64_t i) {
    cloud.noise[i] = std::min(cloud.noise[i], noise[i]);
  }));
  cloud.median_spacing = Median(cloud.spacing);
  cloud.median_noise = Median(cloud.noise);
  return estimated;
}

}  // namespace rilievo
